// Golden views (reliability V3): at least 60 pictures of what designers see, of synthetic scenes and of the
// scripts' designs through model, stream and mirror. A picture is right when its structure and its colours
// are near enough to the golden one's; that a wrong one is not is tested too.
//
// HANDLOFT_UPDATE_GOLDEN=1 build/release/bin/integration_client_views --gtest_filter='All/*' writes them
// anew, and build/golden_views.png, all on one sheet: look at it before they are committed.

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "client-hmd/render/offscreen_context.h"
#include "tests/integration/client-hmd/golden_designs.h"
#include "tests/integration/client-hmd/golden_view.h"

namespace handloft::client {
namespace {

using test::GoldenGroup;
using test::GoldenView;

const std::filesystem::path folder = "tests/data/golden/views";
constexpr std::size_t fewest_views = 60;
constexpr std::uintmax_t most_bytes = 3U << 20;
constexpr int sheet_columns = 8;

bool updating() {
  return std::getenv("HANDLOFT_UPDATE_GOLDEN") != nullptr;
}

const std::vector<GoldenGroup>& groups() {
  static const std::vector<GoldenGroup> all{{"synthetic", test::synthetic_views()},
                                            {"gestures", test::gesture_views()},
                                            {"ghosts", test::ghost_views()},
                                            {"film", test::film_views()},
                                            {"transparency", test::transparency_views()},
                                            {"mouse", test::mouse_views()},
                                            {"seat", test::seat_views()},
                                            {"panel", test::panel_views()},
                                            {"sculpt", test::sculpt_views()}};
  return all;
}

std::filesystem::path path_of(const GoldenView& view) {
  return folder / (view.name + ".png");
}

/// RGB of seven bits, all filters, hardest compression: small enough for a repository. What is lost, half a
/// level in the mean, is well below what views may differ by.
::testing::AssertionResult write_small_png(const std::filesystem::path& path, const Image& image) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return ::testing::AssertionFailure() << "cannot write " << path;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  constexpr int hardest = 9, bits = 8;
  png_set_compression_level(png, hardest);
  png_set_filter(png, 0, PNG_ALL_FILTERS);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width_px), static_cast<png_uint_32>(image.height_px),
               bits, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  std::vector<png_byte> row(3 * static_cast<std::size_t>(image.width_px));
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                      static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) {
        row[3 * static_cast<std::size_t>(x) + c] = static_cast<png_byte>(image.rgba[4 * at + c] & 0xFEU);
      }
    }
    png_write_row(png, row.data());
  }
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
  return ::testing::AssertionSuccess();
}

Image beside(const Image& left, const Image& right) {
  Image both{left.width_px + right.width_px, left.height_px, {}};
  for (int y = 0; y < both.height_px; ++y) {
    for (const Image* one : {&left, &right}) {
      const auto row = 4 * static_cast<std::size_t>(one->width_px);
      const auto from = one->rgba.begin() + static_cast<std::ptrdiff_t>(row * static_cast<std::size_t>(y));
      both.rgba.insert(both.rgba.end(), from, from + static_cast<std::ptrdiff_t>(row));
    }
  }
  return both;
}

/// Moved to the right; what comes in at the left is the edge again.
Image shifted(const Image& image, int by_px) {
  Image moved = image;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      const auto to = static_cast<std::size_t>(y * image.width_px + x);
      const auto from = static_cast<std::size_t>(y * image.width_px + std::max(x - by_px, 0));
      std::copy_n(&image.rgba[4 * from], 4, &moved.rgba[4 * to]);
    }
  }
  return moved;
}

struct Likeness {
  double similarity = 0.0, difference = 0.0;
  bool passes(const GoldenView& view) const {
    return similarity >= view.least_similarity && difference <= view.largest_difference;
  }
};

Likeness compare(const Image& a, const Image& b) {
  const Result<double> similarity = structural_similarity(a, b);
  const Result<double> difference = mean_absolute_difference(a, b);
  return {similarity ? *similarity : 0.0, difference ? *difference : 255.0};
}

/// All of them on one sheet, in the table's order.
void write_sheet(const std::filesystem::path& path) {
  std::vector<Image> pictures;
  for (const GoldenGroup& group : groups()) {
    for (const GoldenView& view : group.views) {
      Result<Image> picture = read_png(path_of(view));
      if (picture) pictures.push_back(std::move(*picture));
    }
  }
  int cells = 0;
  for (const Image& picture : pictures) cells += picture.width_px > test::view_width_px ? 2 : 1;
  const int rows = (cells + sheet_columns - 1) / sheet_columns + 2;
  Image sheet{sheet_columns * test::view_width_px, rows * test::view_height_px, {}};
  sheet.rgba.assign(4 * static_cast<std::size_t>(sheet.width_px) * static_cast<std::size_t>(sheet.height_px),
                    255);
  int x0 = 0, y0 = 0;
  for (const Image& picture : pictures) {
    if (x0 + picture.width_px > sheet.width_px) {
      x0 = 0;
      y0 += test::view_height_px;
    }
    if (y0 + picture.height_px > sheet.height_px) break;
    for (int y = 0; y < picture.height_px; ++y) {
      const auto to = 4 * (static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(sheet.width_px) +
                           static_cast<std::size_t>(x0));
      const auto from = 4 * static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px);
      std::copy_n(&picture.rgba[from], 4 * static_cast<std::size_t>(picture.width_px), &sheet.rgba[to]);
    }
    x0 += picture.width_px;
  }
  EXPECT_TRUE(write_png(path, sheet).ok());
}

/// One context and one renderer for all views of a process: the shaders are compiled once.
class GoldenViews : public testing::TestWithParam<std::string> {
 protected:
  static void SetUpTestSuite() {
    Result<std::unique_ptr<OffscreenContext>> context = OffscreenContext::create();
    ASSERT_TRUE(context.ok()) << context.error().describe();
    context_ = std::move(*context);
    Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
    ASSERT_TRUE(renderer.ok()) << renderer.error().describe();
    renderer_ = std::move(*renderer);
  }
  static void TearDownTestSuite() {
    renderer_.reset();
    context_.reset();
    if (updating()) write_sheet("build/golden_views.png");
  }

  static Image draw(const Frame& frame, Transparency transparency) {
    RenderOptions still;
    still.supersampling = 2;
    still.transparency = transparency;
    const Result<Image> image = renderer_->draw_to_image(frame, still);
    EXPECT_TRUE(image.ok()) << image.error().describe();
    return image.ok() ? *image : Image{};
  }

  static Image picture(const GoldenView& view, const Frame& frame) {
    if (view.eye_distance_m <= 0.0) return draw(frame, view.transparency);
    Frame left = frame, right = frame;
    const glm::dvec3 aside =
        frame.eye.world_from_eye.orientation * glm::dvec3(0.5 * view.eye_distance_m, 0.0, 0.0);
    left.eye.world_from_eye.position -= aside;
    right.eye.world_from_eye.position += aside;
    return beside(draw(left, view.transparency), draw(right, view.transparency));
  }

  static inline std::unique_ptr<OffscreenContext> context_;
  static inline std::unique_ptr<Renderer> renderer_;
};

TEST_P(GoldenViews, Match_V3) {
  const auto group = std::find_if(groups().begin(), groups().end(),
                                  [](const GoldenGroup& one) { return one.name == GetParam(); });
  ASSERT_NE(group, groups().end());
  for (const GoldenView& view : group->views) {
    SCOPED_TRACE(view.name);
    const Image drawn = picture(view, view.frame());
    if (updating()) {
      ASSERT_TRUE(write_small_png(path_of(view), drawn));
      continue;
    }
    const Result<Image> golden = read_png(path_of(view));
    ASSERT_TRUE(golden.ok()) << golden.error().describe();
    const Likeness likeness = compare(drawn, *golden);
    EXPECT_GE(likeness.similarity, view.least_similarity);
    EXPECT_LE(likeness.difference, view.largest_difference);
    if (!likeness.passes(view)) (void)write_png("build/view_" + view.name + "_failed.png", drawn);
    // What the thresholds are worth: a picture that is three pixels off is refused.
    EXPECT_FALSE(compare(shifted(drawn, 3), *golden).passes(view))
        << "a similarity of " << compare(shifted(drawn, 3), *golden).similarity << " passes";
  }
}

std::vector<std::string> group_names() {
  std::vector<std::string> names;
  for (const char* name :
       {"synthetic", "gestures", "ghosts", "film", "transparency", "mouse", "seat", "panel", "sculpt"}) {
    names.emplace_back(name);
  }
  return names;
}
INSTANTIATE_TEST_SUITE_P(All, GoldenViews, testing::ValuesIn(group_names()),
                         [](const auto& group) { return group.param; });

/// Another thing in the picture, or the same thing otherwise, does not pass for the golden one.
class WrongViews : public GoldenViews {};

TEST_F(WrongViews, AreRefused_V3) {
  if (updating()) GTEST_SKIP() << "nothing to compare with";
  const auto without = [](const char* id) {
    return [id](Frame& frame) {
      auto scene = std::make_shared<Scene>(*frame.scene);
      EXPECT_EQ(scene->entities.erase(id), 1U);
      frame.scene = scene;
    };
  };
  struct Case {
    std::string view, what;
    std::function<void(Frame&)> spoil;
  };
  const std::vector<Case> cases{
      {"synthetic_surface", "other shading", [](Frame& frame) { frame.shading = Shading::zebra; }},
      {"mouse_surface", "other shading", [](Frame& frame) { frame.shading = Shading::zebra; }},
      {"mouse_surface", "no top", without("top")},
      {"mouse_both", "no heel", without("heel")},
      {"seat_surface", "no head rest", without("head-rest")},
      {"panel_zebra", "other shading", [](Frame& frame) { frame.shading = Shading::studio; }},
      {"ghosts_two", "one is missing", [](Frame& frame) { frame.ghosts.pop_back(); }},
      {"ghosts_two", "other colours",
       [](Frame& frame) {
         for (GhostHint& ghost : frame.ghosts) ghost.colour = {0.05F, 0.5F, 0.1F};
       }},
      {"film_hand_hides", "not hidden", [](Frame& frame) { frame.hand_occlusion = HandOcclusion::off; }},
      {"gestures_disk", "no disk", [](Frame& frame) { frame.disks.clear(); }},
      {"hood_icons", "no icons",
       [](Frame& frame) {
         frame.scene = test::changed(*frame.scene, "hood", [](Entity& hood) { hood.icons = nullptr; });
       }},
      {"synthetic_points", "a turned eye",
       [](Frame& frame) {
         frame.eye.world_from_eye.orientation *= glm::angleAxis(0.01, glm::dvec3(0.0, 1.0, 0.0));
       }},
  };
  std::set<std::string> looked_at;
  for (const GoldenGroup& group : groups()) {
    for (const GoldenView& view : group.views) {
      for (const Case& one : cases) {
        if (one.view != view.name) continue;
        SCOPED_TRACE(view.name + ": " + one.what);
        looked_at.insert(view.name + one.what);
        Frame frame = view.frame();
        one.spoil(frame);
        const Result<Image> golden = read_png(path_of(view));
        ASSERT_TRUE(golden.ok());
        const Likeness likeness = compare(picture(view, frame), *golden);
        EXPECT_FALSE(likeness.passes(view))
            << "similarity " << likeness.similarity << ", difference " << likeness.difference;
      }
    }
  }
  EXPECT_EQ(looked_at.size(), cases.size()) << "every case has its view";
}

TEST(GoldenViewTable, IsLargeEnoughAndSmallOnDisk_V3) {
  std::set<std::string> names;
  std::uintmax_t bytes = 0;
  std::size_t views = 0;
  for (const GoldenGroup& group : groups()) {
    for (const GoldenView& view : group.views) {
      ++views;
      EXPECT_TRUE(names.insert(view.name).second) << view.name << " comes twice";
      std::error_code missing;
      const std::uintmax_t size = std::filesystem::file_size(path_of(view), missing);
      EXPECT_FALSE(missing) << path_of(view);
      if (!missing) bytes += size;
    }
  }
  EXPECT_GE(views, fewest_views);
  EXPECT_LT(bytes, most_bytes);
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    EXPECT_TRUE(names.count(file.path().stem().string()) == 1) << file.path() << " belongs to no view";
  }
}

}  // namespace
}  // namespace handloft::client
