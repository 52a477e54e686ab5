// SPDX-License-Identifier: MIT
// Temporary file, fsync, rename. O_TMPFILE makes files that vanish with the process, even by SIGKILL; they get a name only for
// the rename. Names of temporary files are short and hidden: ".clume-<process>-<count>.tmp".
#include "src/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>

#include "src/error.h"
#include "src/interrupt.h"

namespace clume {

namespace fs = std::filesystem;

namespace {

std::string reason_of(int error) { return std::generic_category().message(error); }

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

[[noreturn]] void fail_folder(const fs::path& folder, const std::string& reason) {
    throw RenderError(folder.string() + ": cannot write in this folder: " + reason);
}

fs::path temp_name(const fs::path& folder) {
    static std::atomic<unsigned> count{0};
    return folder / (".clume-" + std::to_string(getpid()) + "-" + std::to_string(count++) + ".tmp");
}

/// The file that is to be replaced: `path`, or what it links to.
fs::path resolve_target(const fs::path& path) {
    const std::string prefix = path.string() + ": cannot be written: ";
    if (path.empty() || !path.has_filename()) throw RenderError(prefix + "not a file name");
    struct stat info {};
    if (stat(path.c_str(), &info) == 0) {
        if (S_ISDIR(info.st_mode)) throw RenderError(prefix + "it is a folder");
        if (!S_ISREG(info.st_mode)) throw RenderError(prefix + "it is not a regular file");
    } else if (errno != ENOENT) {
        const int error = errno;
        if (error == ENOTDIR || error == EACCES) fail_folder(folder_of(path), reason_of(error));
        throw RenderError(prefix + reason_of(error));
    }
    fs::path target = path;
    std::error_code error;
    for (int links = 0; fs::is_symlink(target, error); ++links) {
        if (links == 40) throw RenderError(prefix + reason_of(ELOOP));
        target = folder_of(target) / fs::read_symlink(target, error);  // an absolute link replaces the folder
        if (error) throw RenderError(prefix + error.message());
    }
    return target;
}

}  // namespace

OutputFile::OutputFile(const fs::path& path) : path_(path), target_(resolve_target(path)) {
    const fs::path folder = folder_of(target_);
    const bool can_be_named = access("/proc/self/fd", X_OK) == 0;
    int descriptor = can_be_named ? open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666) : -1;
    unnamed_ = descriptor >= 0;
    for (int attempt = 0; attempt < 100 && descriptor < 0; ++attempt) {
        temp_ = temp_name(folder);
        temp_slot_ = remember_temp_file(temp_.c_str());
        descriptor = open(temp_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0) break;
        const int error = errno;
        forget_temp_file(temp_slot_);
        if (error == ENOENT) fail_folder(folder, "it does not exist");
        if (error != EEXIST) fail_folder(folder, reason_of(error));
    }
    if (descriptor < 0) fail_folder(folder, "too many stale .clume-*.tmp files");
    stream_ = fdopen(descriptor, "w+b");
    if (stream_ == nullptr) {
        const int error = errno;
        close(descriptor);
        if (!temp_.empty()) unlink(temp_.c_str());
        forget_temp_file(temp_slot_);
        fail(reason_of(error));
    }
}

OutputFile::~OutputFile() {
    if (stream_ != nullptr) std::fclose(stream_);
    if (!temp_.empty()) unlink(temp_.c_str());
    forget_temp_file(temp_slot_);
}

void OutputFile::fail(const std::string& reason) const { throw RenderError(path_.string() + ": cannot be written: " + reason); }

void OutputFile::commit() {
    errno = 0;
    if (std::ferror(stream_) != 0) fail(errno != 0 ? reason_of(errno) : "a write failed (is the disk full?)");
    if (std::fflush(stream_) != 0 || fsync(fileno(stream_)) != 0) fail(reason_of(errno));
    if (unnamed_) {
        temp_ = temp_name(folder_of(target_));
        temp_slot_ = remember_temp_file(temp_.c_str());
        const std::string self = "/proc/self/fd/" + std::to_string(fileno(stream_));
        if (linkat(AT_FDCWD, self.c_str(), AT_FDCWD, temp_.c_str(), AT_SYMLINK_FOLLOW) != 0) fail(reason_of(errno));
    }
    std::FILE* closing = stream_;
    stream_ = nullptr;
    if (std::fclose(closing) != 0) fail(reason_of(errno));
    if (std::rename(temp_.c_str(), target_.c_str()) != 0) fail(reason_of(errno));
    temp_.clear();
    // The name, too, should outlive a power cut; a folder that can't be synced is no reason to fail.
    const int folder = open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder >= 0) {
        fsync(folder);
        close(folder);
    }
}

void check_writable(const fs::path& path) { OutputFile probe(path); }

}  // namespace clume
