// SPDX-License-Identifier: MIT
// NanoVDB files of ABI 32. The layout of nodes is the library's (nanovdb/NanoVDB.h); that they lie where they say they do, inside
// the grid, aligned, and each in one place only, is checked here before they are looked at: the library's own reader trusts it.
#include <fmt/format.h>
#include <nanovdb/NanoVDB.h>

#include <algorithm>
#include <array>

#include "src/byte_reader.h"
#include "src/decompress.h"
#include "src/input_file.h"
#include "src/voxel_file.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

/// Files are "NanoVDB0", or "NanoVDB2" since 32.6; grids "NanoVDB0" or "NanoVDB1".
constexpr std::uint64_t magic_0 = 0x304244566f6e614e, magic_1 = magic_0 + (1ull << 56), magic_2 = magic_0 + (2ull << 56);
constexpr std::uint32_t major_version = 32;

enum Codec : std::uint16_t { none = 0, zip = 1, blosc = 2 };

/// The most that deflate makes of a byte is 1032 of them, LZ4 255.
constexpr std::uint64_t most_inflation = 1100;
/// The library cuts what Blosc gets into pieces of this size.
constexpr std::uint64_t blosc_piece = 1ull << 30;

/// nanovdb::io::MetaData (util/IO.h), which precedes the grids of a segment.
struct MetaData {
    std::uint64_t grid_size, file_size, name_key, voxel_count;
    std::uint32_t grid_type, grid_class;
    double world_box[6];
    std::int32_t index_box[6];
    double voxel_size[3];
    std::uint32_t name_size, node_count[4], tile_count[3];
    std::uint16_t codec, padding;
    std::uint32_t version;
};
static_assert(sizeof(MetaData) == 176);

struct alignas(NANOVDB_DATA_ALIGNMENT) Chunk {
    char bytes[NANOVDB_DATA_ALIGNMENT];
};

/// A grid's bytes, aligned as its nodes want it, and safe access to them.
class GridBytes {
  public:
    GridBytes(const std::string& name, std::uint64_t byte_size)
        : name_(name), chunks_((byte_size + sizeof(Chunk) - 1) / sizeof(Chunk)), size_(byte_size) {}

    char* data() { return reinterpret_cast<char*>(chunks_.data()); }
    std::uint64_t size() const { return size_; }
    [[noreturn]] void fail(const std::string& why) const { throw SceneError(fmt::format("{}: corrupt: {}", name_, why)); }

    /// The node that begins `offset` bytes after byte `from`, and where that is; `byte_size` bytes of it are there.
    template <class Node>
    const Node& node(std::uint64_t from, std::int64_t offset, std::uint64_t byte_size, std::uint64_t& at) const {
        at = from + static_cast<std::uint64_t>(offset);
        if (at % NANOVDB_DATA_ALIGNMENT != 0 || at > size_ || byte_size > size_ - at)
            fail(fmt::format("a node is to be at byte {} + {} of a grid of {} bytes", from, offset, size_));
        return *reinterpret_cast<const Node*>(reinterpret_cast<const char*>(chunks_.data()) + at);
    }

  private:
    const std::string& name_;
    std::vector<Chunk> chunks_;
    std::uint64_t size_;
};

/// Tree of values that the library calls Build: float, double or one of its quantised floats.
template <class Build>
class TreeReader {
    using Root = typename nanovdb::NanoRoot<Build>::DataType;
    using Upper = typename nanovdb::NanoUpper<Build>::DataType;
    using Lower = typename nanovdb::NanoLower<Build>::DataType;
    using Leaf = typename nanovdb::NanoLeaf<Build>::DataType;

  public:
    TreeReader(const std::string& name, const GridBytes& bytes, std::uint64_t file_bytes)
        : name_(name), bytes_(bytes), file_bytes_(file_bytes) {}

    VoxelGrid run() {
        std::uint64_t at = 0, root_at = 0;
        const auto& tree =
            bytes_.template node<nanovdb::TreeData<3>>(sizeof(nanovdb::GridData), 0, sizeof(nanovdb::TreeData<3>), at);
        const auto root_offset = static_cast<std::int64_t>(tree.mNodeOffset[3]);
        bytes_.template node<Root>(at, root_offset, sizeof(Root), root_at);
        const auto& root = bytes_.template node<Root>(at, root_offset, sizeof(Root), root_at);
        using Tile = typename Root::Tile;
        const std::uint64_t table_bytes = std::uint64_t{root.mTableSize} * sizeof(Tile);
        std::uint64_t table_at = 0;
        const Tile* tiles = &bytes_.template node<Tile>(root_at, sizeof(Root), table_bytes, table_at);
        BrickSet bricks(name_, static_cast<double>(root.mBackground), file_bytes_);
        for (std::uint32_t i = 0; i < root.mTableSize; ++i) {
            const Tile& tile = tiles[i];
            const glm::ivec3 origin = origin_of(tile.key);
            if (tile.child == 0) {
                if (tile.state != 0) bricks.add_tile(origin, 4096, static_cast<double>(tile.value));
                continue;
            }
            read_node<Upper>(bricks, root_at, tile.child, origin, 4096);
        }
        return bricks.build([this](std::uint32_t source, float* samples, std::uint64_t active[8]) {
            std::uint64_t ignored = 0;
            const Leaf& leaf = bytes_.template node<Leaf>(leaves_[source], 0, leaf_bytes(leaves_[source]), ignored);
            for (std::uint32_t n = 0; n < brick_samples; ++n) {
                samples[n] = static_cast<float>(leaf.getValue(n));
                active[n / 64] |= std::uint64_t{leaf.mValueMask.isOn(n)} << (n % 64);
            }
        });
    }

  private:
    glm::ivec3 origin_of(std::uint64_t key) const {
        constexpr std::uint64_t low = (1 << 21) - 1;
        const auto coordinate = [&](int shift) {
            return static_cast<std::int32_t>(static_cast<std::uint32_t>((key >> shift) & low) << 12);
        };
        const glm::ivec3 origin(coordinate(42), coordinate(21), coordinate(0));
        for (int i = 0; i < 3; ++i)
            if (origin[i] < -largest_lattice_coordinate || origin[i] > largest_lattice_coordinate - 4096)
                bytes_.fail(fmt::format("a node at ({}, {}, {}), beyond the lattice of ±2^29", origin.x, origin.y, origin.z));
        return origin;
    }

    /// Nodes that were shared would make few bytes a tree without end.
    void count(std::uint64_t byte_size) {
        visited_bytes_ += byte_size;
        if (visited_bytes_ > bytes_.size()) bytes_.fail("nodes with several parents");
    }

    std::uint64_t leaf_bytes(std::uint64_t at) const {
        if constexpr (std::is_same_v<Build, nanovdb::FpN>) {
            std::uint64_t ignored = 0;
            const Leaf& leaf = bytes_.template node<Leaf>(at, 0, sizeof(Leaf), ignored);
            if (leaf.mFlags >> 5 > 4) bytes_.fail(fmt::format("a leaf of 2^{} bits per sample", leaf.mFlags >> 5));
            return leaf.memUsage();
        }
        return sizeof(Leaf);
    }

    template <class Node>
    void read_node(BrickSet& bricks, std::uint64_t parent, std::int64_t offset, const glm::ivec3& origin, int side) {
        std::uint64_t here = 0;
        const Node& node = bytes_.template node<Node>(parent, offset, sizeof(Node), here);
        count(sizeof(Node));
        constexpr int log2 = std::is_same_v<Node, Upper> ? 5 : 4, low = (1 << log2) - 1;
        const int step = side >> log2;
        for (int n = 0; n < 1 << (3 * log2); ++n) {
            const auto i = static_cast<std::uint32_t>(n);
            const glm::ivec3 at = origin + step * glm::ivec3(n >> (2 * log2), (n >> log2) & low, n & low);
            if (!node.mChildMask.isOn(i)) {
                if (node.mValueMask.isOn(i)) bricks.add_tile(at, step, static_cast<double>(node.mTable[i].value));
            } else if constexpr (log2 == 5) {
                read_node<Lower>(bricks, here, node.mTable[i].child, at, step);
            } else {
                std::uint64_t leaf_at = 0;
                bytes_.template node<Leaf>(here, node.mTable[i].child, sizeof(Leaf), leaf_at);
                count(leaf_bytes(leaf_at));
                bricks.add_leaf(at, static_cast<std::uint32_t>(leaves_.size()));
                leaves_.push_back(leaf_at);
            }
        }
    }

    const std::string& name_;
    const GridBytes& bytes_;
    std::uint64_t file_bytes_;
    std::vector<std::uint64_t> leaves_;
    std::uint64_t visited_bytes_ = 0;
};

class NvdbFile : public VoxelFile {
  public:
    explicit NvdbFile(const std::filesystem::path& path) : name_(path.string()), bytes_(read_file_bytes(path)) {
        ByteReader in(name_, bytes_);
        do read_segment(in);
        while (in.left() > 0);
    }

    const std::vector<VoxelFileEntry>& entries() const override { return entries_; }

    VoxelGrid read(std::size_t index) const override {
        const GridBytes grid = load(places_[index]);
        std::uint64_t at = 0;
        const auto& head = grid.node<nanovdb::GridData>(0, 0, sizeof(nanovdb::GridData), at);
        if (head.mMagic != magic_0 && head.mMagic != magic_1) grid.fail("a grid without the right magic number");
        check_version(grid, head.mVersion.id());
        if (static_cast<std::uint32_t>(head.mGridType) != places_[index].grid_type)
            grid.fail("a grid of another type than told");
        VoxelGrid out = read_tree(grid, head.mGridType);
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) out.axes[column][row] = head.mMap.mMatD[3 * row + column];
            out.origin[row] = head.mMap.mVecD[row];
        }
        return out;
    }

  private:
    /// Where a grid's bytes are.
    struct Place {
        std::uint64_t at, file_size, grid_size;
        std::uint32_t grid_type;
        std::uint16_t codec;
    };

    template <class Messages>
    static void check_version(const Messages& in, std::uint32_t version) {
        if (version >> 21 != major_version)
            in.fail(fmt::format("version {} of NanoVDB; known: {}", version >> 21, major_version));
    }

    void read_segment(ByteReader& in) {
        if (in.left() < 8)
            in.fail(in.at() == 0 ? "unknown format: not a NanoVDB file" : "cut short or corrupt: bytes after the grids");
        const auto magic = in.get<std::uint64_t>();
        if (magic == __builtin_bswap64(magic_0)) in.fail("a NanoVDB file of the other byte order");
        if (magic != magic_0 && magic != magic_2) in.fail("unknown format: not a NanoVDB file");
        check_version(in, in.get<std::uint32_t>());
        const auto count = in.get<std::uint16_t>();
        const auto codec = in.get<std::uint16_t>();
        if (codec > blosc) in.fail(fmt::format("unknown NanoVDB codec {}; known: none, zip, blosc", codec));
        std::vector<MetaData> segment;
        for (int i = 0; i < count; ++i) {
            segment.push_back(in.get<MetaData>());
            const MetaData& meta = segment.back();
            std::string_view text = in.take(meta.name_size);
            entries_.push_back(describe(meta, std::string(text.substr(0, text.find('\0')))));
        }
        for (const MetaData& meta : segment) {
            places_.push_back({in.at(), meta.file_size, meta.grid_size, meta.grid_type, codec});
            in.take(meta.file_size);
        }
    }

    static VoxelFileEntry describe(const MetaData& meta, std::string name) {
        using Type = nanovdb::GridType;
        VoxelFileEntry out{std::move(name), "", ""};
        const bool known = meta.grid_type < static_cast<std::uint32_t>(Type::End);
        out.type = known ? nanovdb::toStr(static_cast<Type>(meta.grid_type)) : fmt::format("type {}", meta.grid_type);
        switch (known ? static_cast<Type>(meta.grid_type) : Type::Unknown) {
            case Type::Float:
            case Type::Double:
            case Type::Fp4:
            case Type::Fp8:
            case Type::Fp16:
            case Type::FpN:
                break;
            default:
                out.refusal = fmt::format("not a float grid but {}", out.type);
        }
        if (out.refusal.empty() && meta.grid_class == static_cast<std::uint32_t>(nanovdb::GridClass::LevelSet))
            out.refusal = "a level set";
        return out;
    }

    GridBytes load(const Place& place) const {
        ByteReader in(name_, std::string_view(bytes_).substr(0, place.at + place.file_size));
        in.seek(place.at);
        if (place.grid_size < sizeof(nanovdb::GridData) + sizeof(nanovdb::TreeData<3>))
            in.fail(fmt::format("corrupt: a grid of {} bytes", place.grid_size));
        const bool impossible =
            place.codec == none ? place.grid_size > place.file_size : place.grid_size / most_inflation > place.file_size;
        if (impossible)
            in.fail(fmt::format("cut short or corrupt: {} bytes cannot hold a grid of {}", place.file_size, place.grid_size));
        if (place.grid_size > physical_memory_bytes() / 2)
            in.fail(fmt::format("a grid of {:.1f} GB, and half of this machine's memory is {:.1f}",
                                static_cast<double>(place.grid_size) * 1e-9,
                                static_cast<double>(physical_memory_bytes()) * 0.5e-9));
        GridBytes out(name_, place.grid_size);
        if (place.codec == none) {
            std::memcpy(out.data(), in.take(place.grid_size).data(), place.grid_size);
            return out;
        }
        const std::uint64_t piece = place.codec == zip ? place.grid_size : blosc_piece;
        for (std::uint64_t done = 0; done < place.grid_size; done += piece) {
            const std::uint64_t size = std::min(piece, place.grid_size - done);
            const std::string_view from = in.take(in.get<std::uint64_t>());
            if (!(place.codec == zip ? unzip(from, out.data() + done, size) : unblosc(from, out.data() + done, size)))
                in.fail(fmt::format("corrupt: {} compressed bytes don't give the {} that are expected", from.size(), size));
        }
        return out;
    }

    VoxelGrid read_tree(const GridBytes& grid, nanovdb::GridType type) const {
        switch (type) {
            case nanovdb::GridType::Double:
                return TreeReader<double>(name_, grid, bytes_.size()).run();
            case nanovdb::GridType::Fp4:
                return TreeReader<nanovdb::Fp4>(name_, grid, bytes_.size()).run();
            case nanovdb::GridType::Fp8:
                return TreeReader<nanovdb::Fp8>(name_, grid, bytes_.size()).run();
            case nanovdb::GridType::Fp16:
                return TreeReader<nanovdb::Fp16>(name_, grid, bytes_.size()).run();
            case nanovdb::GridType::FpN:
                return TreeReader<nanovdb::FpN>(name_, grid, bytes_.size()).run();
            default:
                return TreeReader<float>(name_, grid, bytes_.size()).run();
        }
    }

    std::string name_, bytes_;
    std::vector<VoxelFileEntry> entries_;
    std::vector<Place> places_;
};

}  // namespace

std::unique_ptr<VoxelFile> open_nvdb(const std::filesystem::path& path) { return std::make_unique<NvdbFile>(path); }

}  // namespace clume
