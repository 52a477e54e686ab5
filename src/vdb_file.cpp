#include "src/voxel_file.h"
#include "src/error.h"
namespace clume {
std::unique_ptr<VoxelFile> open_vdb(const std::filesystem::path& path) { throw SceneError(path.string() + ": not yet"); }
std::unique_ptr<VoxelFile> open_nvdb(const std::filesystem::path& path) { throw SceneError(path.string() + ": not yet"); }
}
