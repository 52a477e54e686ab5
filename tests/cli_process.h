// SPDX-License-Identifier: MIT
// The built binary as a process of its own, in a fresh folder with a small scene: what it prints, how it ends, what it leaves.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace clume::test {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// A started clume, in its own folder, with stdout and stderr on pipes. `environment`: NAME=VALUE added to this process's
/// own; `before`: a command that starts clume, such as "unshare -m".
class Process {
  public:
    Process(const Words& words, const fs::path& folder, const Words& environment = {}, const Words& before = {}) {
        int out[2], err[2];
        REQUIRE(pipe2(out, O_CLOEXEC) == 0);
        REQUIRE(pipe2(err, O_CLOEXEC) == 0);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
        posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
        posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
        Words all = before;
        all.push_back(CLUME_BINARY);
        all.insert(all.end(), words.begin(), words.end());
        std::vector<char*> argv, env;
        for (const std::string& word : all) argv.push_back(const_cast<char*>(word.c_str()));
        argv.push_back(nullptr);
        for (char** variable = environ; *variable != nullptr; ++variable) env.push_back(*variable);
        for (const std::string& variable : environment) env.push_back(const_cast<char*>(variable.c_str()));
        env.push_back(nullptr);
        const int failed = posix_spawnp(&process_, argv[0], &actions, nullptr, argv.data(), env.data());
        posix_spawn_file_actions_destroy(&actions);
        close(out[1]);
        close(err[1]);
        pipes_[0] = {out[0], POLLIN, 0};
        pipes_[1] = {err[0], POLLIN, 0};
        REQUIRE(failed == 0);
    }
    ~Process() {
        if (!ended_) {
            kill(process_, SIGKILL);
            waitpid(process_, nullptr, 0);
        }
        for (const pollfd& p : pipes_)
            if (p.fd >= 0) close(p.fd);
    }
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;

    /// Reads until `enough` is true (returns true), both pipes are closed, or `seconds` have gone.
    template <class Predicate>
    bool read_until(Predicate enough, double seconds) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
        while (pipes_[0].fd >= 0 || pipes_[1].fd >= 0) {
            if (enough()) return true;
            if (std::chrono::steady_clock::now() > end) return false;
            poll(pipes_, 2, 10);
            look_at_memory();
            for (int i = 0; i < 2; ++i) {
                if (pipes_[i].fd < 0 || pipes_[i].revents == 0) continue;
                char block[4096];
                const auto count = read(pipes_[i].fd, block, sizeof block);
                if (count > 0) {
                    (i == 0 ? out : err).append(block, static_cast<std::size_t>(count));
                } else {
                    close(pipes_[i].fd);
                    pipes_[i].fd = -1;
                }
            }
        }
        return enough();
    }
    void send(int signal_number) const { kill(process_, signal_number); }
    /// Largest resident memory of the ended process, to a hundredth of a second before its end. Not what wait4 says: that counts
    /// what this process held when the other began.
    std::size_t peak_bytes() const { return peak_bytes_; }
    /// The exit code; minus the signal that killed it; −1000 if it did not end in time.
    int wait(double seconds = 120) {
        read_until([] { return false; }, seconds);
        if (pipes_[0].fd >= 0 || pipes_[1].fd >= 0) return -1000;
        int status = 0;
        waitpid(process_, &status, 0);
        ended_ = true;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }

    std::string out, err;

  private:
    void look_at_memory() {
        std::ifstream status("/proc/" + std::to_string(process_) + "/status");
        for (std::string line; std::getline(status, line);)
            if (line.starts_with("VmHWM:")) peak_bytes_ = 1024 * std::stoull(line.substr(6));
    }

    pid_t process_ = 0;
    std::size_t peak_bytes_ = 0;
    pollfd pipes_[2] = {{-1, 0, 0}, {-1, 0, 0}};
    bool ended_ = false;
};

/// A fresh folder with a small scene in it.
struct SceneFolder {
    fs::path path;
    SceneFolder() {
        static int count = 0;
        path = fs::temp_directory_path() / ("clume-cli-" + std::to_string(getpid()) + "-" + std::to_string(count++));
        fs::create_directories(path);
        std::ofstream(path / "puff.json") << R"({
  "camera": { "origin": [0, 0, -4], "target": [0, 0, 0] },
  "film": { "width": 32, "height": 24 },
  "render": { "spp": 4, "strategy": "delta" },
  "media": [ { "type": "ellipsoids", "kernel": "gaussian",
               "primitives": [ { "center": [0, 0, 0], "scale": 0.5, "density": 4 } ] } ],
  "lights": [ { "type": "constant", "radiance": 1 } ]
})";
    }
    ~SceneFolder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    std::size_t files() const { return static_cast<std::size_t>(std::distance(fs::directory_iterator(path), {})); }
};

/// Runs to the end; an ended process.
struct Run {
    int code;
    std::string out, err;
    Run(const Words& words, const fs::path& folder) {
        Process process(words, folder);
        code = process.wait();
        out = process.out;
        err = process.err;
    }
};

/// A command line that must fail: its exit code, and what is said on stderr about it.
struct WrongUse {
    Words words;
    int code;
    const char* says;
};

/// Checks that each ends as it must, having printed nothing on stdout and left no file that was not there before. One line on
/// stderr, but for code 4: it lists the devices.
inline void check_wrong_uses(const fs::path& folder, const std::vector<WrongUse>& uses) {
    const auto files = [&] { return std::distance(fs::recursive_directory_iterator(folder), {}); };
    const auto before = files();
    for (const WrongUse& use : uses) {
        const Run run(use.words, folder);
        INFO(Catch::StringMaker<Words>::convert(use.words) << "\n" << run.err);
        CHECK(run.code == use.code);
        CHECK(run.out.empty());
        CHECK_THAT(run.err, Catch::Contains(use.says));
        if (use.code != 4) CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
        CHECK(files() == before);
    }
}

}  // namespace clume::test
