// SPDX-License-Identifier: MIT
// The header becomes a plan: which column holds which field. Rows of fixed size are then read at known offsets; rows with
// lists are walked. An ascii element stands on a line of its own, as every writer has it.
#include "src/ply_reader.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "src/error.h"
#include "src/input_file.h"
#include "src/json_reader.h"
#include "src/ply_header.h"

namespace clume {

using namespace ply;

namespace {

/// What a vertex may give, in the order of the values read.
enum Field {
    x,
    y,
    z,
    scale_0,
    scale_1,
    scale_2,
    rot_0,
    rot_1,
    rot_2,
    rot_3,
    density,
    albedo_0,
    albedo_1,
    albedo_2,
    emission_0,
    emission_1,
    emission_2,
    g_own,
    field_count
};

template <typename Value>
double load_as(const char* from, bool swap) {
    std::array<char, sizeof(Value)> bytes;
    std::memcpy(bytes.data(), from, sizeof(Value));
    if (swap)
        for (std::size_t i = 0; i < sizeof(Value) / 2; ++i) std::swap(bytes[i], bytes[sizeof(Value) - 1 - i]);
    return static_cast<double>(std::bit_cast<Value>(bytes));
}

double load(Scalar type, const char* from, bool swap) {
    switch (type) {
        case Scalar::i8:
            return load_as<std::int8_t>(from, swap);
        case Scalar::u8:
            return load_as<std::uint8_t>(from, swap);
        case Scalar::i16:
            return load_as<std::int16_t>(from, swap);
        case Scalar::u16:
            return load_as<std::uint16_t>(from, swap);
        case Scalar::i32:
            return load_as<std::int32_t>(from, swap);
        case Scalar::u32:
            return load_as<std::uint32_t>(from, swap);
        case Scalar::f32:
            return load_as<float>(from, swap);
        case Scalar::f64:
            return load_as<double>(from, swap);
    }
    return 0;
}

class Reader {
  public:
    using Sink = std::function<void(const PlyEllipsoid&, std::size_t, std::size_t)>;

    Reader(const std::filesystem::path& path, const PlyOptions& options)
        : name_(path.string()), options_(options), bytes_(read_file_bytes(path)), header_(read_header(bytes_, name_)) {
        at_ = header_.data_offset;
        line_ = header_.lines;
        vertex_ = header_.find("vertex");
        format_ = header_.format;
    }

    void run(const Sink& sink) {
        plan();
        swap_ = (format_ == Format::big) == (std::endian::native == std::endian::little);
        for (const Element& element : header_.elements) {
            if (&element == vertex_) {
                if (format_ == Format::ascii)
                    read_ascii(sink);
                else
                    read_binary(sink);
            } else {
                skip(element);
            }
        }
        check_end();
    }

  private:
    [[noreturn]] void fail(const std::string& why) const {
        if (format_ == Format::ascii || in_header_) throw SceneError(fmt::format("{}:{}: {}", name_, line_, why));
        throw SceneError(fmt::format("{}: {}", name_, why));
    }
    [[noreturn]] void fail_primitive(std::size_t index, const std::string& why) const {
        fail(fmt::format("primitive {}: {}", index, why));
    }

    std::string_view rest() const { return std::string_view(bytes_).substr(at_); }

    /// The next line without its end; false at the end of the file.
    bool next_line(std::string_view& line) {
        if (at_ >= bytes_.size()) return false;
        const std::string_view left = rest();
        const std::size_t end = std::min(left.find('\n'), left.size());
        line = left.substr(0, end);
        at_ += std::min(end + 1, left.size());
        ++line_;
        return true;
    }

    int column(std::string_view name) const {
        for (std::size_t i = 0; i < vertex_->properties.size(); ++i)
            if (vertex_->properties[i].name == name && !vertex_->properties[i].is_list) return static_cast<int>(i);
        return -1;
    }

    /// Takes all of a group, none if the file has none of it; some is an error.
    bool group(std::string_view stem, int count, int first_field, bool required) {
        std::vector<std::string> missing;
        for (int i = 0; i < count; ++i) {
            const std::string name = fmt::format("{}{}", stem, i);
            columns_[static_cast<std::size_t>(first_field + i)] = column(name);
            if (column(name) < 0) missing.push_back(name);
        }
        if (missing.empty()) return true;
        if (required || missing.size() < static_cast<std::size_t>(count))
            missing_.insert(missing_.end(), missing.begin(), missing.end());
        return false;
    }

    void plan() {
        columns_.fill(-1);
        for (int i = 0; i < 3; ++i) {
            const std::string name(1, "xyz"[i]);
            columns_[static_cast<std::size_t>(i)] = column(name);
            if (column(name) < 0) missing_.push_back(name);
        }
        group("scale_", 3, scale_0, true);
        group("rot_", 4, rot_0, false);
        const int extinction = column("sigma_t") >= 0 ? column("sigma_t") : column("sigma_t_0");
        const int opacity = column("opacity");
        is_opacity_ = options_.density ? *options_.density == DensityEncoding::opacity : extinction < 0;
        columns_[density] = (is_opacity_ ? opacity >= 0 : extinction < 0) ? opacity : extinction;
        if (columns_[density] < 0) missing_.push_back("sigma_t (or sigma_t_0, or opacity)");
        if (options_.read_albedo && !group("albedo_", 3, albedo_0, false)) albedo_is_sh_ = group("f_dc_", 3, albedo_0, false);
        if (options_.read_emission) group("emission_", 3, emission_0, false);
        columns_[g_own] = column("g");
        if (!missing_.empty()) fail(fmt::format("missing in element vertex: {}", fmt::join(missing_, ", ")));
        in_header_ = false;
        if (vertex_->count > std::numeric_limits<std::uint32_t>::max() - 1 && vertex_->count <= bytes_.size())
            fail(fmt::format("{} vertices are more than 32-bit numbers can name", vertex_->count));
    }

    [[noreturn]] void fail_short(const Element& element, std::uint64_t needed_row_bytes) const {
        const std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
        const std::uint64_t needed = element.count > most / needed_row_bytes ? most : element.count * needed_row_bytes;
        fail(fmt::format("needs {}{} bytes for {} {}, holds {}",
                         element.has_lists || format_ == Format::ascii ? "at least " : "", needed, element.count,
                         element.name == "vertex" ? "vertices" : "rows of " + in_quotes(element.name), rest().size()));
    }

    /// The count is held by the bytes that are left, as far as that can be told without reading them.
    void check_count(const Element& element) const {
        // An ascii row is at least a digit and a separator per property; the last separator may be missing.
        const std::uint64_t row = format_ == Format::ascii ? 2 * element.properties.size() : element.row_bytes;
        const std::uint64_t held = rest().size() + (format_ == Format::ascii ? 1 : 0);
        if (row > 0 && element.count > held / row) fail_short(element, row);
    }

    /// Walks one binary row from at_, storing each property's offset. False if the file ends in it.
    bool walk_row(const Element& element, std::vector<std::size_t>& offsets) {
        offsets.clear();
        for (const Property& property : element.properties) {
            offsets.push_back(at_);
            const std::size_t left = bytes_.size() - at_;
            const std::size_t fixed = size_of(property.is_list ? property.count_type : property.type);
            if (fixed > left) return false;
            std::size_t list_bytes = 0;
            if (property.is_list) {
                const double count = load(property.count_type, bytes_.data() + at_, swap_);
                if (count < 0) fail(fmt::format("negative length of list {}", in_quotes(property.name)));
                list_bytes = static_cast<std::size_t>(count) * size_of(property.type);
            }
            if (list_bytes > left - fixed) return false;
            at_ += fixed + list_bytes;
        }
        return true;
    }

    void skip(const Element& element) {
        check_count(element);
        if (element.properties.empty()) return;
        if (format_ == Format::ascii) {
            std::string_view line;
            for (std::uint64_t i = 0; i < element.count; ++i)
                if (!next_row(line))
                    fail(fmt::format("the file ends after {} of {} rows of {}", i, element.count, in_quotes(element.name)));
        } else if (!element.has_lists) {
            at_ += element.count * element.row_bytes;
        } else {
            std::vector<std::size_t> offsets;
            for (std::uint64_t i = 0; i < element.count; ++i)
                if (!walk_row(element, offsets))
                    fail(fmt::format("the file ends after {} of {} rows of {}", i, element.count, in_quotes(element.name)));
        }
    }

    void check_end() {
        std::string_view line;
        if (format_ == Format::ascii ? next_row(line) : at_ < bytes_.size()) fail("the file holds more than its header says");
    }

    void read_binary(const Sink& sink) {
        check_count(*vertex_);
        const std::uint64_t count = vertex_->count;
        if (!vertex_->has_lists && vertex_ == &header_.elements.back() && rest().size() != count * vertex_->row_bytes)
            fail(fmt::format("needs {} bytes for {} vertices, holds {}", count * vertex_->row_bytes, count, rest().size()));
        struct Source {
            std::size_t property, offset;
            Scalar type;
            int field;
        };
        std::vector<Source> sources;
        std::size_t offset = 0;
        for (std::size_t i = 0; i < vertex_->properties.size(); ++i) {
            for (int field = 0; field < field_count; ++field)
                if (columns_[static_cast<std::size_t>(field)] == static_cast<int>(i))
                    sources.push_back({i, offset, vertex_->properties[i].type, field});
            offset += size_of(vertex_->properties[i].type);
        }
        std::array<double, field_count> values{};
        std::vector<std::size_t> offsets;
        for (std::uint64_t row = 0; row < count; ++row) {
            if (vertex_->has_lists) {
                if (!walk_row(*vertex_, offsets)) fail(fmt::format("the file ends after {} of {} vertices", row, count));
                for (const Source& s : sources)
                    values[static_cast<std::size_t>(s.field)] = load(s.type, bytes_.data() + offsets[s.property], swap_);
            } else {
                const char* base = bytes_.data() + at_ + row * vertex_->row_bytes;
                for (const Source& s : sources)
                    values[static_cast<std::size_t>(s.field)] = load(s.type, base + s.offset, swap_);
            }
            sink(decode(values, row), row, count);
        }
        if (!vertex_->has_lists) at_ += count * vertex_->row_bytes;
    }

    /// The next line that isn't blank.
    bool next_row(std::string_view& line) {
        while (next_line(line))
            if (line.find_first_not_of(" \t\r\v\f") != std::string_view::npos) return true;
        return false;
    }

    double parse(std::string_view word, const Property& property) const {
        if (word.starts_with('+')) word.remove_prefix(1);
        double value = 0;
        const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
        if (read.ptr != word.data() + word.size() || read.ec == std::errc::invalid_argument)
            fail(fmt::format("{} of property {} is not a number", in_quotes(word), in_quotes(property.name)));
        if (read.ec == std::errc::result_out_of_range) return std::strtod(std::string(word).c_str(), nullptr);
        return value;
    }

    void read_ascii(const Sink& sink) {
        check_count(*vertex_);
        const auto& properties = vertex_->properties;
        std::vector<std::vector<std::size_t>> fields(properties.size());
        for (std::size_t field = 0; field < field_count; ++field)
            if (columns_[field] >= 0) fields[static_cast<std::size_t>(columns_[field])].push_back(field);
        std::array<double, field_count> values{};
        std::string_view line;
        for (std::uint64_t row = 0; row < vertex_->count; ++row) {
            if (!next_row(line)) fail(fmt::format("needs {} vertices, holds {}", vertex_->count, row));
            const auto words = split_words(line);
            std::size_t at = 0;
            for (std::size_t i = 0; i < properties.size(); ++i) {
                if (at >= words.size())
                    fail_primitive(row, fmt::format("the line ends before property {}", in_quotes(properties[i].name)));
                const std::string_view word = words[at++];
                if (properties[i].is_list) {
                    const double length = parse(word, properties[i]);
                    if (!(length >= 0) || length > static_cast<double>(words.size() - at))
                        fail_primitive(row, fmt::format("the line ends inside list {}", in_quotes(properties[i].name)));
                    at += static_cast<std::size_t>(length);
                    continue;
                }
                if (fields[i].empty()) continue;
                const double value = parse(word, properties[i]);
                for (const std::size_t field : fields[i])
                    values[field] = properties[i].type == Scalar::f32 ? static_cast<double>(static_cast<float>(value)) : value;
            }
            if (at != words.size()) fail_primitive(row, "the line holds more values than the header says");
            sink(decode(values, row), row, vertex_->count);
        }
    }

    bool has(Field field) const { return columns_[field] >= 0; }

    PlyEllipsoid decode(const std::array<double, field_count>& v, std::size_t row) const {
        constexpr double sh_0 = 0.28209479;  // the constant spherical harmonic, as captures have it
        PlyEllipsoid e;
        for (int field = 0; field < field_count; ++field)
            if (columns_[static_cast<std::size_t>(field)] >= 0 && !std::isfinite(v[static_cast<std::size_t>(field)]))
                fail_primitive(
                    row,
                    fmt::format("{} is not finite",
                                vertex_->properties[static_cast<std::size_t>(columns_[static_cast<std::size_t>(field)])].name));
        e.center = {v[x], v[y], v[z]};
        e.scale = {v[scale_0], v[scale_1], v[scale_2]};
        if (options_.scale == ScaleEncoding::log) e.scale = glm::exp(e.scale);
        for (int i = 0; i < 3; ++i)
            if (!(e.scale[i] > 0) || !std::isfinite(e.scale[i]))
                fail_primitive(row, fmt::format("scale_{} must be positive and finite, not {}", i, e.scale[i]));
        if (has(rot_0)) {
            e.rotation = {v[rot_0], v[rot_1], v[rot_2], v[rot_3]};
            // By the largest component first: squares of tiny or huge ones must not vanish or overflow.
            const double largest =
                std::max(std::max(std::abs(v[rot_0]), std::abs(v[rot_1])), std::max(std::abs(v[rot_2]), std::abs(v[rot_3])));
            if (!(largest > 0)) fail_primitive(row, "zero quaternion");
            e.rotation = glm::normalize(e.rotation / largest);
        }
        e.density_is_depth = is_opacity_;
        const double d = v[density];
        e.density = is_opacity_ ? std::max(d, 0.0) + std::log1p(std::exp(-std::abs(d))) : d;
        if (e.density < 0) fail_primitive(row, fmt::format("density must not be negative, is {}", d));
        if (has(albedo_0)) {
            e.albedo = {v[albedo_0], v[albedo_1], v[albedo_2]};
            if (albedo_is_sh_) e.albedo = glm::clamp(0.5 + sh_0 * e.albedo, 0.0, 1.0);
            for (int i = 0; i < 3; ++i)
                if (!(e.albedo[i] >= 0 && e.albedo[i] <= 1))
                    fail_primitive(row, fmt::format("albedo_{} must be in [0,1], is {}", i, e.albedo[i]));
        }
        if (has(emission_0)) {
            e.emission = {v[emission_0], v[emission_1], v[emission_2]};
            for (int i = 0; i < 3; ++i)
                if (e.emission[i] < 0)
                    fail_primitive(row, fmt::format("emission_{} must not be negative, is {}", i, e.emission[i]));
        }
        if (has(g_own)) {
            if (!(std::abs(v[g_own]) < 1)) fail_primitive(row, fmt::format("g must be in (-1,1), is {}", v[g_own]));
            e.g = v[g_own];
        }
        return e;
    }

    std::string name_;
    PlyOptions options_;
    std::string bytes_;
    Header header_;
    std::size_t at_ = 0;
    int line_ = 0;
    bool in_header_ = true;
    Format format_ = Format::ascii;
    bool swap_ = false;
    const Element* vertex_ = nullptr;
    std::array<int, field_count> columns_{};
    std::vector<std::string> missing_;
    bool is_opacity_ = false;
    bool albedo_is_sh_ = false;
};

}  // namespace

void read_ply(const std::filesystem::path& path, const PlyOptions& options,
              const std::function<void(const PlyEllipsoid&, std::size_t, std::size_t)>& sink) {
    Reader(path, options).run(sink);
}

}  // namespace clume
