// SPDX-License-Identifier: MIT
// Image files: what is written is read back bit for bit, a preview has the right bytes, and a write that fails, for whatever
// reason, leaves the folder as it was.
#include <png.h>
#include <sys/resource.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "src/error.h"
#include "src/image_writer.h"
#include "src/stats_json.h"

using namespace clume;
namespace fs = std::filesystem;

namespace {

/// A fresh folder that goes away with the test.
struct Folder {
    fs::path path;
    Folder() {
        static int count = 0;
        path = fs::temp_directory_path() / ("clume-image-" + std::to_string(getpid()) + "-" + std::to_string(count++));
        fs::create_directories(path);
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    std::size_t files() const { return static_cast<std::size_t>(std::distance(fs::directory_iterator(path), {})); }
};

RenderImage noise_image(CropWindow window, int film_width, int film_height) {
    std::mt19937 rng(7);
    std::uniform_real_distribution<float> uniform(0, 4);
    const auto count = static_cast<std::size_t>(window.x1 - window.x0) * static_cast<std::size_t>(window.y1 - window.y0);
    RenderImage image{film_width, film_height, window, {}, {}, {}, {}, {}};
    for (std::size_t i = 0; i < count; ++i) {
        for (int c = 0; c < 3; ++c) {
            image.rgb.push_back(uniform(rng) * 1e3f);
            image.variance.push_back(uniform(rng) * 1e-9f);
        }
        image.alpha.push_back(uniform(rng) / 4);
        image.samples.push_back(static_cast<std::uint32_t>(rng()));
    }
    return image;
}

std::string message_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const RenderError& error) {
        return error.what();
    }
    return "no error";
}

/// Until it ends, no file of this process grows beyond `bytes`: a full disk, as far as a writer can tell.
struct FileSizeLimit {
    rlimit before{};
    void (*handler)(int) = std::signal(SIGXFSZ, SIG_IGN);
    explicit FileSizeLimit(rlim_t bytes) {
        getrlimit(RLIMIT_FSIZE, &before);
        const rlimit small{bytes, before.rlim_max};
        setrlimit(RLIMIT_FSIZE, &small);
    }
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &before);
        std::signal(SIGXFSZ, handler);
    }
};

}  // namespace

TEST_CASE("ImageWriter.ExrRoundTripKeepsEveryBit", "[quick]") {
    const Folder folder;
    const fs::path file = folder.path / "a.exr";
    const CropWindow window = GENERATE(CropWindow{0, 0, 37, 21}, CropWindow{5, 3, 36, 20}, CropWindow{36, 20, 37, 21});
    const RenderImage image = noise_image(window, 37, 21);
    const ImageMetadata metadata{{"scene", "scenes/plume.json"}, {"seed", "18446744073709551615"}, {"warnings", "one\ntwo"}};
    write_exr(file, image, metadata);
    ImageMetadata read;
    const RenderImage back = read_exr(file, &read);
    CHECK(back.film_width == 37);
    CHECK(back.film_height == 21);
    CHECK(back.window.x0 == window.x0);
    CHECK(back.window.y0 == window.y0);
    CHECK(back.window.x1 == window.x1);
    CHECK(back.window.y1 == window.y1);
    CHECK(back.rgb == image.rgb);
    CHECK(back.alpha == image.alpha);
    CHECK(back.variance == image.variance);
    CHECK(back.samples == image.samples);
    for (const auto& entry : metadata) CHECK(std::count(read.begin(), read.end(), entry) == 1);
    CHECK(folder.files() == 1);
}

TEST_CASE("ImageWriter.PngHoldsSrgbOfTheImageOverBlack", "[quick]") {
    const Folder folder;
    const fs::path file = folder.path / "a.png";
    RenderImage image = noise_image({0, 0, 4, 1}, 4, 1);
    image.rgb = {0, 0.0031308f, 0.5f, 1, 2, -1, 0.25f, 0.125f, 0.0625f, NAN, INFINITY, 1e-9f};
    image.alpha = {0, 0.1f, 0.5f, 1};  // makes no difference
    const double exposure = GENERATE(0.0, 1.0);
    write_png(file, image, exposure);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    REQUIRE(png_image_begin_read_from_file(&png, file.c_str()) != 0);
    CHECK(png.format == PNG_FORMAT_RGB);
    CHECK((png.flags & PNG_IMAGE_FLAG_COLORSPACE_NOT_sRGB) == 0);
    std::vector<unsigned> bytes(12);
    std::vector<unsigned char> raw(12);
    REQUIRE(png_image_finish_read(&png, nullptr, raw.data(), 0, nullptr) != 0);
    bytes.assign(raw.begin(), raw.end());
    // Values of the standard's curve, worked out apart from the code.
    const std::vector<unsigned> expected = exposure == 0
                                               ? std::vector<unsigned>{0, 10, 188, 255, 255, 0, 137, 99, 71, 0, 255, 0}
                                               : std::vector<unsigned>{0, 18, 255, 255, 255, 0, 188, 137, 99, 0, 255, 0};
    CHECK(bytes == expected);
    CHECK(folder.files() == 1);
}

TEST_CASE("ImageWriter.FailedWriteLeavesTheOldFileAndNothingElse", "[quick]") {
    const Folder folder;
    const RenderImage image = noise_image({0, 0, 200, 200}, 200, 200);
    for (const char* name : {"a.exr", "a.png", "a.json"}) std::ofstream(folder.path / name) << "old";
    RenderStats stats;
    stats.warnings.assign(10000, "a long line");
    {
        const FileSizeLimit limit(GENERATE(0, 100, 16384));
        CHECK_THAT(message_of([&] { write_exr(folder.path / "a.exr", image); }), Catch::Contains("a.exr: cannot be written: "));
        CHECK_THAT(message_of([&] { write_png(folder.path / "a.png", image, -12); }),
                   Catch::Contains("a.png: cannot be written: "));
        CHECK_THAT(message_of([&] { write_stats_json(folder.path / "a.json", stats); }),
                   Catch::Contains("a.json: cannot be written: "));
    }
    CHECK(folder.files() == 3);
    for (const char* name : {"a.exr", "a.png", "a.json"}) {
        std::string text;
        std::ifstream(folder.path / name) >> text;
        CHECK(text == "old");
    }
}

TEST_CASE("ImageWriter.UnwritablePlacesAreNamed", "[quick]") {
    const Folder folder;
    std::ofstream(folder.path / "file") << "text";
    fs::create_directory(folder.path / "a.exr");
    CHECK_THAT(message_of([&] { check_writable(folder.path / "none" / "b.exr"); }),
               Catch::EndsWith("none: cannot write in this folder: it does not exist"));
    CHECK_THAT(message_of([&] { check_writable(folder.path / "file" / "b.exr"); }), Catch::Contains("Not a directory"));
    CHECK_THAT(message_of([&] { check_writable(folder.path / "a.exr"); }), Catch::EndsWith("it is a folder"));
    CHECK_THAT(message_of([&] { check_writable("/dev/null"); }), Catch::EndsWith("it is not a regular file"));
    CHECK_THAT(message_of([&] { check_writable(folder.path / std::string(300, 'a')); }), Catch::Contains("too long"));
    if (geteuid() != 0) {
        fs::permissions(folder.path / "a.exr", fs::perms::owner_read | fs::perms::owner_exec);
        CHECK_THAT(message_of([&] { check_writable(folder.path / "a.exr" / "b.exr"); }), Catch::Contains("Permission denied"));
        fs::permissions(folder.path / "a.exr", fs::perms::owner_all);
    }
    CHECK(message_of([&] { check_writable(folder.path / "b.exr"); }) == "no error");
    CHECK(folder.files() == 2);
}

TEST_CASE("ImageWriter.LinksAreFollowed", "[quick]") {
    const Folder folder;
    fs::create_directory(folder.path / "sub");
    fs::create_symlink("sub/real.exr", folder.path / "link.exr");
    const RenderImage image = noise_image({0, 0, 2, 2}, 2, 2);
    for (int i = 0; i < 2; ++i) {  // dangling, then not
        write_exr(folder.path / "link.exr", image);
        CHECK(fs::is_symlink(folder.path / "link.exr"));
        CHECK(fs::is_regular_file(folder.path / "sub" / "real.exr"));
    }
}

TEST_CASE("ImageWriter.ImageThatDoesNotFitItsWindowIsRefused", "[quick]") {
    const Folder folder;
    RenderImage image = noise_image({0, 0, 4, 4}, 4, 4);
    image.alpha.pop_back();
    CHECK_THROWS_AS(write_exr(folder.path / "a.exr", image), RenderError);
    image.alpha.push_back(0);
    image.window.x1 = 5;
    CHECK_THROWS_AS(write_png(folder.path / "a.png", image), RenderError);
    CHECK(folder.files() == 0);
}

TEST_CASE("ImageWriter.DamagedExrIsAnError", "[quick]") {
    const Folder folder;
    const fs::path file = folder.path / "a.exr";
    CHECK_THROWS_AS(read_exr(file), RenderError);
    write_exr(file, noise_image({0, 0, 64, 64}, 64, 64));
    fs::resize_file(file, fs::file_size(file) / 2);
    CHECK_THROWS_AS(read_exr(file), RenderError);
}
