// SPDX-License-Identifier: MIT
// Scene files, among small files of every kind that a scene can name. A scene that names anything beside those is left alone.
#include "src/error.h"
#include "src/json_reader.h"
#include "src/scene_reader.h"
#include "tests/fuzz/small_files.h"
#include "tests/fuzz/targets.h"

namespace clume::fuzz {

namespace {

bool stays_inside(const JsonValue& value) {
    for (const JsonValue& item : value.items)
        if (!stays_inside(item)) return false;
    for (const JsonMember& member : value.members)
        if ((member.key == "file" && member.value.text.find('/') != std::string::npos) || !stays_inside(member.value)) return false;
    return true;
}

void run(std::string_view bytes) {
    static const SmallFiles files;
    try {
        if (stays_inside(parse_json(bytes, "scene"))) parse_scene(bytes, files.folder() / "scene.json");
    } catch (const SceneError&) {
    }
}

}  // namespace

const Target scene{"scene", run, scene_memory};

}  // namespace clume::fuzz
