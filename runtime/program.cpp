// SPDX-License-Identifier: MIT
// Building and caching. PoCL is never asked for binaries (that compiles every kernel generically); it keeps its own cache.
#include "runtime/program.h"

#include <cctype>
#include <optional>
#include <stdexcept>

#include "runtime/check.h"
#include "runtime/hash.h"
#include "runtime/disk_cache.h"

namespace clume {

namespace {

std::string raw_log(const cl::Program& program, const cl::Device& device) {
    try {
        std::string log = program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device);
        while (!log.empty() && (log.back() == '\0' || std::isspace(static_cast<unsigned char>(log.back())))) log.pop_back();
        return log;
    } catch (const cl::Error&) {
        return "(no build log)";
    }
}

/// clBuildProgram alone: the bindings' build() asks for the log when it fails, and reports that call if there is none.
cl_int build(const cl::Program& program, const cl::Device& device, const std::string& options) {
    const cl_device_id id = device();
    return clBuildProgram(program(), 1, &id, options.c_str(), nullptr, nullptr);
}

/// A driver may refuse a binary it once made; that's a miss.
std::optional<cl::Program> build_from_cache(const Queue& queue, const std::string& key, const std::string& options) {
    const std::optional<Binary> binary = load_binary(cache_folder(), key);
    if (!binary) return std::nullopt;
    try {
        const std::vector<cl::Device> devices{queue.info().device};
        cl::Program program(queue.context(), devices, cl::Program::Binaries{*binary});
        if (build(program, queue.info().device, options) != CL_SUCCESS) return std::nullopt;
        return program;
    } catch (const cl::Error&) {
        return std::nullopt;
    }
}

void store_in_cache(const cl::Program& program, const std::string& key) {
    try {
        const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
        if (binaries.size() == 1) store_binary(cache_folder(), key, binaries[0]);
    } catch (const cl::Error&) {
        return;  // a platform that gives no binaries has no cache
    }
}

}  // namespace

ProgramOptions& ProgramOptions::define(std::string name, std::string value) {
    defines.emplace_back(std::move(name), std::move(value));
    return *this;
}

ProgramOptions& ProgramOptions::define(std::string name, long long value) {
    return define(std::move(name), std::to_string(value));
}

std::string ProgramOptions::text() const {
    std::string text = optimised ? "-cl-std=CL1.2" : "-cl-std=CL1.2 -cl-opt-disable";
    for (const auto& [name, value] : defines) {
        std::string both = name;
        both.append("=").append(value);
        if (both.find_first_of(" \t\n\"'\\;") != std::string::npos || name.empty()) throw std::invalid_argument("not a usable define: " + both);
        text.append(" -D").append(both);
    }
    return text;
}

cl::Program build_program(const Queue& queue, std::string_view root_file, const ProgramOptions& options) {
    return build_source(queue, assemble_source(root_file), options);
}

cl::Program build_source(const Queue& queue, const std::string& source, const ProgramOptions& options) {
    const std::string text = options.text();
    const bool cached = !queue.info().is_pocl();
    const std::string key = cached ? program_key(queue.info(), source, text) : std::string();
    if (cached) {
        if (auto program = build_from_cache(queue, key, text)) return *program;
    }
    cl::Program program = checked(queue.label(), [&] { return cl::Program(queue.context(), source, false); });
    const cl_int code = build(program, queue.info().device, text);
    if (code == CL_BUILD_PROGRAM_FAILURE) throw BuildError(queue.label(), text, raw_log(program, queue.info().device));
    if (code != CL_SUCCESS) throw_device_error(cl::Error(code, "clBuildProgram"), queue.label(), "options " + text);
    if (cached) store_in_cache(program, key);
    return program;
}

std::string build_log(const Queue& queue, const cl::Program& program) {
    return raw_log(program, queue.info().device);
}

std::string program_key(const DeviceInfo& info, const std::string& source, const std::string& options) {
    std::string all;
    for (const std::string* part : {&source, &options, &info.name, &info.driver, &info.platform, &info.platform_version}) {
        all += std::to_string(part->size()) + ":";
        all += *part;
    }
    return sha256_hex(all);
}

}  // namespace clume
