// SPDX-License-Identifier: MIT
// Files that are written whole or not at all: a file without a name in the same folder (a hidden temporary one where the
// file system knows none), synced, then renamed over the target. Killed at any moment, it leaves the target as it was.
// A link is followed (the file it names is replaced); devices, pipes and folders are refused.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace clume {

class OutputFile {
  public:
    /// Opens the temporary file. Throws RenderError with the path and the reason.
    explicit OutputFile(const std::filesystem::path& path);
    /// Removes the temporary file unless commit() has succeeded.
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    std::FILE* stream() { return stream_; }
    /// Flushes, syncs and renames. Throws RenderError; earlier failed writes to stream() are found here too.
    void commit();
    /// Throws RenderError "<path>: cannot be written: <reason>".
    [[noreturn]] void fail(const std::string& reason) const;

  private:
    std::filesystem::path path_, target_, temp_;
    std::FILE* stream_ = nullptr;
    int temp_slot_ = -1;
    bool unnamed_ = false;  ///< temp_ is empty until commit()
};

/// Finds out, by making and removing a temporary file, whether `path` can be written; to be asked before a long render.
/// Throws RenderError naming the folder and the reason.
void check_writable(const std::filesystem::path& path);

}  // namespace clume
