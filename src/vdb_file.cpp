// SPDX-License-Identifier: MIT
// OpenVDB files: header, descriptors, metadata and transforms; trees are vdb_tree's. Descriptors and all that belongs to them
// must follow each other, so that reading is linear in the file's size.
#include <fmt/format.h>

#include <array>

#include "src/byte_reader.h"
#include "src/input_file.h"
#include "src/json_reader.h"
#include "src/vdb_tree.h"
#include "src/voxel_file.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

constexpr std::string_view half_suffix = "_HalfFloat";
constexpr char name_separator = '\x1e';  ///< between a grid's name and the number that makes it unique

/// One grid as it lies in the file.
struct Descriptor {
    std::string unique_name, type, instance_of;
    std::uint64_t tree_at = 0;
    VdbTreeFormat format;
    bool is_frustum = false;
    std::string grid_class;
    glm::dmat3 axes{1};
    glm::dvec3 origin{0};
};

class VdbFile : public VoxelFile {
  public:
    explicit VdbFile(const std::filesystem::path& path) : name_(path.string()), bytes_(read_file_bytes(path)) {
        ByteReader in(name_, bytes_);
        if (bytes_.size() < 8 || in.get<std::uint64_t>() != 0x56444220) in.fail("unknown format: not an OpenVDB file");
        if (const auto version = in.get<std::uint32_t>(); version < 222 || version > 224)
            in.fail(fmt::format("file version {} of OpenVDB; known: 222 to 224 (OpenVDB 3 and later)", version));
        in.take(8);  // the version of the library that wrote it
        if (in.get<std::uint8_t>() == 0) in.fail("grids without offsets (an OpenVDB stream); write it as a file");
        in.take(36);  // its unique id
        read_metadata(in);
        const auto count = in.get<std::int32_t>();
        for (std::int32_t i = 0; i < count; ++i) read_descriptor(in);
        for (const Descriptor& d : descriptors_) entries_.push_back(describe(d));
    }

    const std::vector<VoxelFileEntry>& entries() const override { return entries_; }

    VoxelGrid read(std::size_t index) const override {
        const Descriptor& grid = descriptors_[index];
        const Descriptor* tree = &grid;
        if (!grid.instance_of.empty()) {
            tree = nullptr;
            for (const Descriptor& other : descriptors_)
                if (other.unique_name == grid.instance_of && other.instance_of.empty() && other.type == grid.type)
                    tree = &other;
            if (tree == nullptr)
                throw SceneError(fmt::format("{}: corrupt: grid {} shares the tree of {}, which isn't there", name_,
                                             in_quotes(entries_[index].name), in_quotes(grid.instance_of)));
        }
        ByteReader in(name_, bytes_);
        in.seek(tree->tree_at);
        VoxelGrid out = read_vdb_tree(std::move(in), tree->format);
        out.axes = grid.axes;
        out.origin = grid.origin;
        return out;
    }

  private:
    /// The values of string entries by name, of which only "class" is of use; others are skipped.
    std::string read_metadata(ByteReader& in) const {
        std::string grid_class;
        const auto count = in.get<std::uint32_t>();
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::string key = in.text(), type = in.text();
            const std::string_view value = in.take(in.get<std::uint32_t>());
            if (key == "class" && type == "string") grid_class = value;
        }
        return grid_class;
    }

    void read_descriptor(ByteReader& in) {
        Descriptor d;
        d.unique_name = in.text();
        d.type = in.text();
        d.instance_of = in.text();
        if (d.type.ends_with(half_suffix)) {
            d.format.saved_as_half = true;
            d.type.resize(d.type.size() - half_suffix.size());
        }
        const auto grid_at = in.get<std::int64_t>();
        in.get<std::int64_t>();  // where its samples begin
        const auto end = in.get<std::int64_t>();
        const auto here = static_cast<std::int64_t>(in.at());
        if (grid_at < here || end < grid_at || end > static_cast<std::int64_t>(in.size()))
            in.fail(fmt::format("cut short or corrupt: grid {} from byte {} to {} of {}", in_quotes(d.unique_name), grid_at,
                                end, in.size()));
        // Nothing of this grid lies beyond `end`.
        ByteReader grid(name_, std::string_view(bytes_).substr(0, static_cast<std::size_t>(end)));
        grid.seek(static_cast<std::uint64_t>(grid_at));
        d.format.compression = grid.get<std::uint32_t>();
        d.format.is_double = d.type == "Tree_double_5_4_3";
        d.grid_class = read_metadata(grid);
        read_transform(grid, d);
        d.tree_at = grid.at();
        in.seek(static_cast<std::uint64_t>(end));
        descriptors_.push_back(std::move(d));
    }

    /// Maps take lattice coordinates as a row vector.
    void read_transform(ByteReader& in, Descriptor& d) const {
        const auto vector = [&] {
            glm::dvec3 v;
            for (int i = 0; i < 3; ++i) v[i] = in.get<double>();
            return v;
        };
        const auto scaled = [&](const glm::dvec3& scale) {
            d.axes = glm::dmat3(scale.x, 0, 0, 0, scale.y, 0, 0, 0, scale.z);
            for (int i = 0; i < 4; ++i) vector();  // voxel size and three inverses, which follow from the scale
        };
        const std::string type = in.text();
        if (type == "AffineMap" || type == "UnitaryMap") {
            std::array<double, 16> m;
            for (double& value : m) value = in.get<double>();
            if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) in.fail("corrupt: an affine transform that isn't");
            for (int i = 0; i < 3; ++i) d.axes[i] = {m[4 * i], m[4 * i + 1], m[4 * i + 2]};
            d.origin = {m[12], m[13], m[14]};
        } else if (type == "ScaleMap" || type == "UniformScaleMap") {
            scaled(vector());
        } else if (type == "TranslationMap") {
            d.origin = vector();
        } else if (type == "ScaleTranslateMap" || type == "UniformScaleTranslateMap") {
            d.origin = vector();
            scaled(vector());
        } else if (type == "NonlinearFrustumMap") {
            d.is_frustum = true;
        } else {
            in.fail(fmt::format("corrupt or unsupported: a transform of type {}", in_quotes(type)));
        }
    }

    VoxelFileEntry describe(const Descriptor& d) const {
        VoxelFileEntry out;
        out.name = d.unique_name.substr(0, d.unique_name.find(name_separator));
        out.type = d.type == "Tree_float_5_4_3" ? "float" : d.type == "Tree_double_5_4_3" ? "double" : d.type;
        if (out.type == d.type)
            out.refusal = fmt::format("not a float grid but {}", in_quotes(d.type));
        else if (d.grid_class == "level set")
            out.refusal = "a level set";
        else if (d.is_frustum)
            out.refusal = "a grid with a frustum transform";
        if (d.format.saved_as_half && out.type != d.type) out.type += " as half";
        return out;
    }

    std::string name_, bytes_;
    std::vector<Descriptor> descriptors_;
    std::vector<VoxelFileEntry> entries_;
};

}  // namespace

std::unique_ptr<VoxelFile> open_vdb(const std::filesystem::path& path) { return std::make_unique<VdbFile>(path); }

}  // namespace clume
