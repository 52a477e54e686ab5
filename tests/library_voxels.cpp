// SPDX-License-Identifier: MIT
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include "tests/library_voxels.h"

#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/openvdb.h>

#include <stdexcept>

namespace clume::test {

namespace {

openvdb::math::MapBase::Ptr make_map(const LibraryGrid& g) {
    using namespace openvdb::math;
    const Vec3d scale(g.axes[0].x, g.axes[1].y, g.axes[2].z), origin(g.origin.x, g.origin.y, g.origin.z);
    if (g.map == "scale") return MapBase::Ptr(new ScaleMap(scale));
    if (g.map == "uniform scale") return MapBase::Ptr(new UniformScaleMap(scale.x()));
    if (g.map == "translate") return MapBase::Ptr(new TranslationMap(origin));
    if (g.map == "scale translate") return MapBase::Ptr(new ScaleTranslateMap(scale, origin));
    if (g.map == "uniform scale translate") return MapBase::Ptr(new UniformScaleTranslateMap(scale.x(), origin));
    Mat3d linear;
    for (int row = 0; row < 3; ++row)
        for (int c = 0; c < 3; ++c) linear(row, c) = g.axes[row][c];
    if (g.map == "unitary") return MapBase::Ptr(new UnitaryMap(linear));
    Mat4d m = Mat4d::identity();
    m.setMat3(linear);
    m.setTranslation(origin);
    return MapBase::Ptr(new AffineMap(m));
}

template <class Grid>
openvdb::GridBase::Ptr fill(const LibraryGrid& g) {
    using Value = typename Grid::ValueType;
    auto grid = Grid::create(Value(g.background));
    for (const LibraryTile& t : g.tiles) {
        int level = t.side >= 4096 ? 3 : t.side >= 128 ? 2 : 1;
        grid->tree().addTile(level, openvdb::Coord(t.lo.x, t.lo.y, t.lo.z), Value(t.value), t.active);
    }
    for (const LibraryVoxel& v : g.voxels) {
        const openvdb::Coord at(v.at.x, v.at.y, v.at.z);
        if (v.active)
            grid->tree().setValueOn(at, Value(v.value));
        else
            grid->tree().setValueOff(at, Value(v.value));
    }
    return grid;
}

openvdb::GridBase::Ptr make_grid(const LibraryGrid& g) {
    openvdb::initialize();
    openvdb::GridBase::Ptr grid = g.kind == "double"   ? fill<openvdb::DoubleGrid>(g)
                                  : g.kind == "vector" ? fill<openvdb::Vec3SGrid>(g)
                                  : g.kind == "int"    ? fill<openvdb::Int32Grid>(g)
                                                       : fill<openvdb::FloatGrid>(g);
    grid->setName(g.name);
    grid->setSaveFloatAsHalf(g.kind == "half");
    grid->setGridClass(g.kind == "level set" ? openvdb::GRID_LEVEL_SET : openvdb::GRID_FOG_VOLUME);
    if (g.kind == "frustum")
        grid->setTransform(
            openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(8)), 0.5, 10));
    else
        grid->setTransform(openvdb::math::Transform::Ptr(new openvdb::math::Transform(make_map(g))));
    return grid;
}

template <class Build>
nanovdb::GridHandle<nanovdb::HostBuffer> quantised(const openvdb::GridBase::Ptr& grid) {
    nanovdb::OpenToNanoVDB<float, Build> convert;
    if constexpr (std::is_same_v<Build, nanovdb::FpN>) convert.oracle().setTolerance(1e-3f);
    return convert(*openvdb::gridPtrCast<openvdb::FloatGrid>(grid));
}

}  // namespace

void write_library_vdb(const std::filesystem::path& path, const std::vector<LibraryGrid>& grids, std::uint32_t compression,
                       bool shared) {
    openvdb::GridPtrVec out;
    for (const LibraryGrid& g : grids) out.push_back(make_grid(g));
    if (shared) out.back()->setTree(out.front()->baseTreePtr());
    openvdb::io::File file(path.string());
    file.setCompression(compression);
    file.write(out);
    file.close();
}

void write_library_nvdb(const std::filesystem::path& path, const std::vector<LibraryGrid>& grids, const std::string& codec,
                        const std::string& type) {
    std::vector<nanovdb::GridHandle<nanovdb::HostBuffer>> handles;
    for (LibraryGrid g : grids) {
        if (g.kind == "float" && type == "double") g.kind = "double";
        const auto grid = make_grid(g);
        if (g.kind != "float" || type == "float")
            handles.push_back(nanovdb::openToNanoVDB(grid));
        else
            handles.push_back(type == "fp4"    ? quantised<nanovdb::Fp4>(grid)
                              : type == "fp8"  ? quantised<nanovdb::Fp8>(grid)
                              : type == "fp16" ? quantised<nanovdb::Fp16>(grid)
                                               : quantised<nanovdb::FpN>(grid));
    }
    nanovdb::io::writeGrids(path.string(), handles,
                            codec == "zip"     ? nanovdb::io::Codec::ZIP
                            : codec == "blosc" ? nanovdb::io::Codec::BLOSC
                                               : nanovdb::io::Codec::NONE);
}

LibrarySamples read_by_library(const std::filesystem::path& path, const std::string& name,
                               const std::vector<glm::ivec3>& points) {
    LibrarySamples out;
    if (path.extension() == ".nvdb") {
        const auto handle = nanovdb::io::readGrid(path.string(), name);
        const auto* grid = handle.grid<float>();
        if (grid == nullptr) throw std::runtime_error("no float grid " + name);
        const auto box = grid->indexBBox();
        out.lo = {box.min()[0], box.min()[1], box.min()[2]};
        out.hi = glm::ivec3(box.max()[0], box.max()[1], box.max()[2]) + 1;
        for (const glm::ivec3& p : points) {
            const nanovdb::Coord at(p.x, p.y, p.z);
            const auto accessor = grid->getAccessor();
            out.values.push_back(accessor.isActive(at) ? accessor.getValue(at) : grid->tree().background());
            const auto world = grid->indexToWorld(nanovdb::Vec3d(p.x, p.y, p.z));
            out.world.emplace_back(world[0], world[1], world[2]);
        }
        return out;
    }
    openvdb::initialize();
    openvdb::io::File file(path.string());
    file.open();
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid(name));
    const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
    out.lo = {box.min().x(), box.min().y(), box.min().z()};
    out.hi = glm::ivec3(box.max().x(), box.max().y(), box.max().z()) + 1;
    for (const glm::ivec3& p : points) {
        const openvdb::Coord at(p.x, p.y, p.z);
        out.values.push_back(grid->tree().isValueOn(at) ? grid->tree().getValue(at) : grid->background());
        const openvdb::Vec3d world = grid->indexToWorld(at);
        out.world.emplace_back(world.x(), world.y(), world.z());
    }
    return out;
}

}  // namespace clume::test
