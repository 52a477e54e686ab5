// SPDX-License-Identifier: MIT
#include "bench/kernels.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <map>

#include "bench/sections.h"
#include "tests/cases.h"

namespace clume::bench {
namespace {

std::vector<std::string> registered;  // names, in order
/// Of an item that has run: what it takes, and the rate of its fastest launch.
struct Best {
    Cost cost;
    double items_s = 0;
};
std::map<std::string, Best> bests;

/// Hands the medians over the repetitions to the session: at once, or at the end in the order registered.
class Reporter : public benchmark::BenchmarkReporter {
public:
    Reporter(Session& session, bool at_once) : session_(session), at_once_(at_once) {}
    bool ReportContext(const Context&) override { return true; }
    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            if (run.run_type != Run::RT_Iteration) continue;
            std::vector<double>& rates = rates_[run.run_name.function_name];
            rates.push_back(run.counters.at("items_per_second"));
            if (at_once_ && rates.size() == static_cast<std::size_t>(run.repetitions)) record(run.run_name.function_name, rates);
        }
    }
    void Finalize() override {
        if (at_once_) return;
        for (const std::string& name : registered)
            if (const auto r = rates_.find(name); r != rates_.end()) record(name, r->second);
    }

private:
    Session& session_;
    bool at_once_;
    std::map<std::string, std::vector<double>> rates_;

    void record(const std::string& name, const std::vector<double>& rates) {
        const double rate = median(rates) * 1e-6, low = *std::min_element(rates.begin(), rates.end()) * 1e-6;
        const auto& [cost, highest] = bests[name];
        Fields fields{{"mitems_s", rate}, {"lowest", low}, {"highest", highest * 1e-6}};
        std::string line = fmt::format("{:44} {:10.3f} {:9.3f} {:9.3f}", name, rate, low, highest * 1e-6);
        // The peaks are the highest rates of single launches, too.
        if (const auto share = share_of(cost, highest, peaks(session_))) {
            line += fmt::format(" {:8.0f} {:7.0f} {:7.1f} {:6.1f} % {}", cost.operations.all, cost.bytes, cost.gathers, 100 * share->value, share->limit);
            fields.insert(fields.end(), {{"operations", cost.operations.all}, {"multiplications", cost.operations.multiplications}, {"bytes", cost.bytes}, {"gathers", cost.gathers}, {"footprint", cost.footprint}, {"share", share->value}, {"limit", share->limit}});
        }
        session_.record(name, line, std::move(fields));
    }
};

void run(benchmark::State& state, const std::string& name, const std::function<Launch(std::uint32_t)>& launch) {
    std::uint32_t number = 0;
    double items = 0;
    for (auto _ : state) {  // NOLINT(clang-analyzer-deadcode.DeadStores)
        const Launch l = launch(number++);
        state.SetIterationTime(l.device_s);
        items += l.items;
        bests[name].cost = l.cost;
        if (l.device_s > 0) bests[name].items_s = std::max(bests[name].items_s, l.items / l.device_s);
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(items));
}

/// `shuffled`: repetitions of all benchmarks in random order, so that a disturbance does not hit one of them alone.
void run_registered(Session& session, bool shuffled) {
    if (!registered.empty()) {
        std::string name = "clume bench", flag = fmt::format("--benchmark_enable_random_interleaving={}", shuffled);
        char* arguments[] = {name.data(), flag.data(), nullptr};
        int count = 2;
        benchmark::Initialize(&count, arguments);
        Reporter reporter(session, !shuffled);
        benchmark::RunSpecifiedBenchmarks(&reporter, ".");
    }
    benchmark::ClearRegisteredBenchmarks();
    registered.clear();
}

/// Processor time of each thread that this process has now.
std::map<int, double> thread_seconds() {
    std::map<int, double> out;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
        const int thread = std::stoi(entry.path().filename().string());
        timespec t;
        // The clock of a thread, as pthread_getcpuclockid makes it.
        if (clock_gettime(~static_cast<clockid_t>(thread) * 8 + 6, &t) == 0) out[thread] = static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    }
    return out;
}

}  // namespace

SizedLaunch::SizedLaunch(Session& session, Queue& queue, cl::Kernel& kernel, const SetArguments& set_arguments, double seconds, std::size_t most_items)
    : queue_(queue), kernel_(kernel), local_(session.device().group_size()), cpu_(session.device().type == "cpu") {
    const std::size_t first = local_ * session.device().compute_units;
    for (std::size_t items = first;; items *= 2) {
        out_ = Buffer<float>(queue, items);
        set_arguments(items, out_);
        if (items == first) queue.launch(kernel, local_, local_);
        // Of three, since a busy machine makes any one seem long.
        const double s = std::min({queue.launch(kernel, items, local_), queue.launch(kernel, items, local_), queue.launch(kernel, items, local_)});
        if (s >= seconds || 2 * items > most_items) return;
    }
}

double SizedLaunch::operator()() const { return queue_.launch(kernel_, items(), local_); }

double SizedLaunch::undisturbed() const {
    if (!cpu_) return (*this)();
    const std::map<int, double> before = thread_seconds();
    const double seconds = (*this)();
    double busiest = 0;
    for (const auto& [thread, after] : thread_seconds())
        if (const auto b = before.find(thread); b != before.end()) busiest = std::max(busiest, after - b->second);
    return busiest > 0 ? std::min(seconds, busiest) : seconds;
}

std::size_t copies_to_fill(Session& session) { return session.device().type == "gpu" ? 64 : 1; }

std::vector<int> kernel_widths(const Session& session) {
    if (session.options().width > 0) return {session.options().width};
    return {cases::vector_widths.begin(), cases::vector_widths.end()};
}

std::string with_width(const std::string& name, int width) { return fmt::format("{}/w{}", name, width); }

void add_kernel_benchmark(Session& session, const std::string& item, const std::function<Launch(std::uint32_t)>& launch) {
    if (!session.wants(item)) return;
    benchmark::RegisterBenchmark(item.c_str(), run, item, launch)->UseManualTime()->MinTime(session.options().quick ? 0.01 : 0.05)->Repetitions(session.rounds(5));
    registered.push_back(item);
}

void bench_kernels_section(Session& session) {
    session.section("kernels",
                    "Kernels one by one by device time: median and lowest of the repetitions, fastest launch; operations, bytes and places looked up\n"
                    "at random per item, and the share of the device's peaks that the fastest launch reaches; wN: lanes per vector.\n" +
                        fmt::format("{:44} {:>10} {:>9} {:>9} {:>8} {:>7} {:>7} {:>8} {}", "", "Mitems/s", "lowest", "highest", "ops", "bytes", "gathers", "share", "of"));
    add_group_benchmarks(session);
    run_registered(session, true);
    add_accelerator_benchmarks(session);
    add_block_benchmarks(session);
    add_sort_benchmarks(session);
    add_ray_benchmarks(session);
    run_registered(session, false);
}

}  // namespace clume::bench
