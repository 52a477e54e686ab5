// SPDX-License-Identifier: MIT
// OpenVDB files with zip-compressed values: the library of some systems is built without zlib and writes none.
#pragma once

#include <blosc.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace clume::test {

/// The file of one grid, written with Blosc and active values only (6), as one with zip and active values only (3).
inline std::string blosc_to_zip(std::string bytes) {
    const auto place = [](std::int64_t value) { return std::string(reinterpret_cast<const char*>(&value), sizeof value); };
    const auto number = [&](std::size_t at) {
        std::int64_t value = 0;
        std::memcpy(&value, bytes.data() + at, sizeof value);
        return value;
    };
    // The grid ends with the file, and its descriptor says where that is; before that, where it begins: with the flags.
    const std::size_t end = bytes.find(place(static_cast<std::int64_t>(bytes.size())));
    if (end == std::string::npos) throw std::runtime_error("no descriptor");
    bytes.at(static_cast<std::size_t>(number(end - 16))) = 3;
    // A block is its size and its bytes, which tell that they are Blosc's.
    for (std::size_t at = end + 8; at + 8 + BLOSC_MIN_HEADER_LENGTH <= bytes.size(); ++at) {
        const auto size = static_cast<std::size_t>(number(at));
        std::size_t plain_size = 0;
        if (size < BLOSC_MIN_HEADER_LENGTH || size > bytes.size() - at - 8 || blosc_cbuffer_validate(bytes.data() + at + 8, size, &plain_size) != 0 ||
            plain_size == 0)
            continue;
        std::string plain(plain_size, '\0');
        if (blosc_decompress_ctx(bytes.data() + at + 8, plain.data(), plain_size, 1) != static_cast<int>(plain_size)) continue;
        std::string packed(compressBound(plain_size), '\0');
        uLongf packed_size = packed.size();
        compress(reinterpret_cast<Bytef*>(packed.data()), &packed_size, reinterpret_cast<const Bytef*>(plain.data()), plain_size);
        packed.resize(packed_size);
        bytes.replace(at, 8 + size, place(static_cast<std::int64_t>(packed_size)) + packed);
        at += 7 + packed_size;
    }
    return bytes.replace(end, 8, place(static_cast<std::int64_t>(bytes.size())));
}

}  // namespace clume::test
