// SPDX-License-Identifier: MIT
// A cursor over the bytes of a file that never reads beyond them. Values are little-endian, as all voxel formats have them.
#pragma once

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "src/error.h"

namespace clume {

static_assert(std::endian::native == std::endian::little, "voxel files are read as they lie in memory");

class ByteReader {
  public:
    /// `name` begins every message.
    ByteReader(std::string name, std::string_view bytes) : name_(std::move(name)), bytes_(bytes) {}

    [[noreturn]] void fail(const std::string& why) const { throw SceneError(fmt::format("{}: {}", name_, why)); }

    std::size_t at() const { return at_; }
    std::size_t left() const { return bytes_.size() - at_; }
    std::size_t size() const { return bytes_.size(); }
    const std::string& name() const { return name_; }

    /// Moves to `position` from the file's start.
    void seek(std::uint64_t position) {
        if (position > bytes_.size())
            fail(fmt::format("cut short or corrupt: something is to be at byte {}, and the file holds {}", position,
                             bytes_.size()));
        at_ = static_cast<std::size_t>(position);
    }

    /// The next `count` bytes.
    std::string_view take(std::uint64_t count) {
        if (count > left()) fail(fmt::format("cut short or corrupt: needs {} bytes at byte {}, holds {}", count, at_, left()));
        const std::string_view out = bytes_.substr(at_, static_cast<std::size_t>(count));
        at_ += out.size();
        return out;
    }

    template <class Value>
    Value get() {
        static_assert(std::is_trivially_copyable_v<Value>);
        Value value;
        std::memcpy(&value, take(sizeof(Value)).data(), sizeof(Value));
        return value;
    }

    /// A 32-bit length and that many bytes.
    std::string text() { return std::string(take(get<std::uint32_t>())); }

  private:
    std::string name_;
    std::string_view bytes_;
    std::size_t at_ = 0;
};

}  // namespace clume
