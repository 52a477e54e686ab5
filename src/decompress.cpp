// SPDX-License-Identifier: MIT
#include "src/decompress.h"

#include <blosc.h>
#include <zlib.h>

namespace clume {

bool unzip(std::string_view from, void* to, std::size_t byte_size) {
    uLongf got = byte_size;
    return uncompress(static_cast<Bytef*>(to), &got, reinterpret_cast<const Bytef*>(from.data()), from.size()) == Z_OK &&
           got == byte_size;
}

bool unblosc(std::string_view from, void* to, std::size_t byte_size) {
    // The decoder believes the buffer's own header: that must agree with what there is, before it is let in.
    std::size_t promised = 0;
    if (blosc_cbuffer_validate(from.data(), from.size(), &promised) != 0 || promised != byte_size) return false;
    return blosc_decompress_ctx(from.data(), to, byte_size, 1) == static_cast<int>(byte_size);
}

}  // namespace clume
