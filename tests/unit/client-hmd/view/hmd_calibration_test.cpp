// What a headset is like, from its file, and its lenses (V4): every field is held to its range, the lens and
// its inverse agree, and the mesh follows the lens to a tenth of a pixel.

#include "client-hmd/view/hmd_calibration.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include "client-hmd/view/lens_mesh.h"
#include "client-hmd/view/stereo.h"

namespace handloft::client {
namespace {

using testing::HasSubstr;

constexpr std::array channels{Channel::red, Channel::green, Channel::blue};

std::string file_text(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

HmdCalibration rift() {
  Result<HmdCalibration> hmd = read_hmd_calibration("deploy/config/hmd-rift-dk1.toml");
  EXPECT_TRUE(hmd.ok()) << hmd.error().describe();
  return hmd.ok() ? *hmd : default_hmd_calibration();
}

/// The default file with one thing in it replaced.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = file_text("deploy/config/hmd.toml");
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string complaint(const std::string& text) {
  const Result<HmdCalibration> hmd = parse_hmd_calibration(text, "hmd.toml");
  return hmd.ok() ? "" : hmd.error().describe();
}

TEST(HmdCalibration, TheDefaultFileSaysWhatTheProgramAssumes) {
  const Result<HmdCalibration> file = read_hmd_calibration("deploy/config/hmd.toml");
  ASSERT_TRUE(file.ok()) << file.error().describe();
  const HmdCalibration built_in = default_hmd_calibration();
  EXPECT_EQ(file->name, built_in.name);
  EXPECT_EQ(file->width_px, built_in.width_px);
  EXPECT_EQ(file->height_px, built_in.height_px);
  EXPECT_EQ(file->refresh_hz, built_in.refresh_hz);
  EXPECT_EQ(file->interpupillary_distance_m, built_in.interpupillary_distance_m);
  for (std::size_t i = 0; i < 2; ++i) {
    const EyeCalibration& read = file->eyes[i];
    const EyeCalibration& known = built_in.eyes[i];
    EXPECT_EQ(read.area.x_px, known.area.x_px);
    EXPECT_EQ(read.area.width_px, known.area.width_px);
    EXPECT_EQ(read.area.height_px, known.area.height_px);
    EXPECT_EQ(read.lens_centre_px, known.lens_centre_px);
    EXPECT_EQ(read.unit_radius_px, known.unit_radius_px);
    EXPECT_EQ(read.tangent_per_unit, known.tangent_per_unit);
    EXPECT_EQ(read.distortion, known.distortion);
    EXPECT_NEAR(read.field_of_view.up_rad, known.field_of_view.up_rad, 1e-12);
    EXPECT_EQ(read.head_from_eye.position, known.head_from_eye.position);
  }
}

TEST(HmdCalibration, NamesTheFieldThatIsWrong) {
  const struct {
    std::string from, to, field;
  } cases[]{
      {"name = \"Two plain halves\"", "name = 3", "name"},
      {"interpupillary_distance_m = 0.063", "interpupillary_distance_m = 63", "interpupillary_distance_m"},
      {"interpupillary_distance_m = 0.063", "interpupillary_distance_m = nan", "interpupillary_distance_m"},
      {"interpupillary_distance_m = 0.063", "pupils = 0.063", "interpupillary_distance_m"},
      {"refresh_hz = 60.0", "refresh_hz = 0", "screen.refresh_hz"},
      {"width_px = 1920", "width_px = 1920.5", "screen.width_px"},
      {"width_px = 1920", "width_px = 1919", "right.area_px"},
      {"area_px = [960, 0, 960, 1080]", "area_px = [959, 0, 960, 1080]", "right.area_px"},
      {"area_px = [0, 0, 960, 1080]", "area_px = [0, 0, 0, 1080]", "left.area_px"},
      {"up = 45.0", "up = 90", "left.field_of_view_deg.up"},
      {"up = 45.0", "upp = 45", "left.field_of_view_deg.up"},
      {"up = 45.0", "up = 45.0, sideways = 3", "left.field_of_view_deg.sideways"},
      {"lens_centre_px = [479.5, 539.5]", "lens_centre_px = [479.5]", "left.lens_centre_px"},
      {"lens_centre_px = [479.5, 539.5]", "lens_centre_px = [479.5, \"a\"]", "left.lens_centre_px[1]"},
      {"unit_radius_px = 540.0", "unit_radius_px = 0", "left.unit_radius_px"},
      {"tangent_per_unit = 1.0", "tangent_per_unit = inf", "left.tangent_per_unit"},
      {"distortion_green = [1.0, 0.0, 0.0, 0.0]", "distortion_green = [1.0, -0.5, 0.0, 0.0]",
       "left.distortion_green"},
      {"distortion_green = [1.0, 0.0, 0.0, 0.0]", "distortion_green = 1", "left.distortion_green"},
      {"[screen]", "[scren]", "screen"},
      {"# position_m = [-0.0315, 0.0, 0.0]", "position_m = [-0.5, 0.0, 0.0]", "left.position_m[0]"},
  };
  for (const auto& one : cases) {
    EXPECT_THAT(complaint(changed(one.from, one.to)), HasSubstr("hmd.toml: " + one.field + ":")) << one.to;
  }
  EXPECT_EQ(complaint(file_text("deploy/config/hmd.toml")), "");
  EXPECT_THAT(complaint("name = \"a"), HasSubstr("hmd.toml:1"));
  EXPECT_THAT(complaint(std::string(1U << 20, '#')), HasSubstr("resource_exhausted"));
  EXPECT_THAT(complaint(""), HasSubstr("is missing"));
  EXPECT_EQ(read_hmd_calibration("nowhere.toml").error().code, ErrorCode::not_found);
}

TEST(HmdLens, SeesWhereThePolynomialSays) {
  const HmdCalibration hmd = rift();
  const EyeCalibration& left = hmd.eyes[0];
  // By hand: half a unit right of the lens centre, green: 0.91317 * 0.5 * (1 + 0.22 / 4 + 0.24 / 16).
  const glm::dvec2 seen = view_tangent(left, Channel::green, left.lens_centre_px + glm::dvec2(160.0, 0.0));
  EXPECT_NEAR(seen.x, 0.91317 * 0.5 * 1.07, 1e-12);
  EXPECT_NEAR(seen.y, 0.0, 1e-15);
  EXPECT_NEAR(view_tangent(left, Channel::blue, left.lens_centre_px + glm::dvec2(0.0, 160.0)).y,
              0.91317 * 0.5 * 1.07 * 1.014, 1e-5);
}

TEST(HmdLens, InverseAgreesOverTheWholeArea_V4) {
  const HmdCalibration hmd = rift();
  double worst_px = 0.0;
  for (const EyeCalibration& eye : hmd.eyes) {
    for (const Channel channel : channels) {
      for (int y = 0; y < eye.area.height_px; y += 13) {
        for (int x = 0; x < eye.area.width_px; x += 11) {
          const glm::dvec2 pixel(x, y);
          const glm::dvec2 back = pixel_seen_at(eye, channel, view_tangent(eye, channel, pixel));
          worst_px = std::max(worst_px, glm::distance(back, pixel));
        }
      }
    }
  }
  EXPECT_LT(worst_px, 1e-9);
  RecordProperty("worst_px", std::to_string(worst_px));
  // What no pixel shows lies outside.
  const glm::dvec2 outside = pixel_seen_at(hmd.eyes[0], Channel::green, {30.0, 0.0});
  EXPECT_GT(outside.x, hmd.eyes[0].area.width_px);
}

/// What the graphics card makes of the mesh at `pixel`: linear between the corners of a triangle.
glm::dvec2 interpolated(const LensMesh& mesh, const EyeCalibration& eye, Channel channel,
                        const glm::dvec2& pixel) {
  const glm::dvec2 at = (pixel + 0.5) / glm::dvec2(eye.area.width_px, eye.area.height_px);
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    std::array<const LensVertex*, 3> corner{};
    for (std::size_t k = 0; k < 3; ++k) corner[k] = &mesh.vertices[mesh.indices[i + k]];
    const glm::dvec2 a(corner[0]->position), b(corner[1]->position), c(corner[2]->position);
    const glm::dmat2 edges(b - a, c - a);
    const glm::dvec2 share = glm::inverse(edges) * (at - a);
    if (share.x < -1e-9 || share.y < -1e-9 || share.x + share.y > 1.0 + 1e-9) continue;
    const auto value = [channel](const LensVertex& v) {
      return glm::dvec2(channel == Channel::red ? v.red : channel == Channel::green ? v.green : v.blue);
    };
    return (1.0 - share.x - share.y) * value(*corner[0]) + share.x * value(*corner[1]) +
           share.y * value(*corner[2]);
  }
  ADD_FAILURE() << "no triangle holds " << pixel.x << "," << pixel.y;
  return {};
}

TEST(LensMesh, FollowsThePolynomialToATenthOfAPixel_V4) {
  const HmdCalibration hmd = rift();
  for (const EyeCalibration& eye : hmd.eyes) {
    const LensMesh mesh = lens_mesh(eye);
    EXPECT_LT(mesh.largest_error_px, 0.1);
    double worst_px = 0.0;
    for (int y = 3; y < eye.area.height_px; y += 97) {
      for (int x = 5; x < eye.area.width_px; x += 83) {
        for (const Channel channel : channels) {
          const glm::dvec2 pixel(x, y);
          const glm::dvec2 shown = interpolated(mesh, eye, channel, pixel);
          // In pixels: where the lens really shows that direction.
          worst_px = std::max(worst_px, glm::distance(pixel_seen_at(eye, channel, shown), pixel));
        }
      }
    }
    EXPECT_LT(worst_px, 0.1);
    RecordProperty("worst_px", std::to_string(worst_px));
  }
  // A coarse grid shows that the measure measures.
  const LensMesh coarse = lens_mesh(hmd.eyes[0], {.tolerance_px = 0.1, .most_cells = 8});
  EXPECT_GT(coarse.largest_error_px, 0.1);
  EXPECT_EQ(coarse.vertices.size(), 81U);
  // Without a lens, the coarsest grid is exact.
  EXPECT_LT(lens_mesh(default_hmd_calibration().eyes[0]).largest_error_px, 1e-9);
}

TEST(HmdLens, DrawsNoMoreThanTheAreaShows) {
  const EyeCalibration plain = default_hmd_calibration().eyes[0];
  const FieldOfView field = visible_field(plain);
  EXPECT_NEAR(std::tan(field.left_rad), 480.0 / 540.0, 1e-12) << "the area is narrower than its 45 degrees";
  EXPECT_NEAR(std::tan(field.up_rad), 1.0, 1e-9);
  const Pinhole pinhole = undistorted_pinhole(plain);
  EXPECT_EQ(pinhole.width_px, 960);
  EXPECT_EQ(pinhole.height_px, 1080);
  EXPECT_NEAR(pinhole.fx_px, 540.0, 1e-9);
  EXPECT_NEAR(pinhole.cx_px, 479.5, 1e-9);
  EXPECT_NEAR(pinhole.cy_px, 539.5, 1e-9);
  // At a lens's centre one pixel of the picture is one of the screen.
  const EyeCalibration lens = rift().eyes[0];
  const Pinhole wide = undistorted_pinhole(lens);
  const double screen_px =
      glm::length(view_tangent(lens, Channel::green, lens.lens_centre_px + glm::dvec2(1, 0)));
  EXPECT_NEAR(wide.fx_px * screen_px, 1.0, 2e-3);
  EXPECT_TRUE(check_pinhole(wide).ok());
}

TEST(HmdCalibration, ScalesToAnyCanvas) {
  const HmdCalibration hmd = rift();
  for (const auto& [width, height] : {std::pair{1280, 800}, {2560, 1600}, {640, 360}, {333, 1000}, {2, 2}}) {
    const HmdCalibration scaled = scaled_to(hmd, width, height);
    for (std::size_t i = 0; i < 2; ++i) {
      const EyeCalibration& eye = scaled.eyes[i];
      EXPECT_GE(eye.area.x_px, 0);
      EXPECT_GE(eye.area.width_px, 1);
      EXPECT_LE(eye.area.x_px + eye.area.width_px, width);
      EXPECT_LE(eye.area.y_px + eye.area.height_px, height);
      EXPECT_TRUE(check_pinhole(undistorted_pinhole(eye)).ok());
    }
  }
  // Twice the size: the same direction at twice the distance from the lens centre.
  const HmdCalibration twice = scaled_to(hmd, 2560, 1600);
  const glm::dvec2 tangent(0.31, -0.22);
  const glm::dvec2 small = pixel_seen_at(hmd.eyes[1], Channel::red, tangent);
  const glm::dvec2 large = pixel_seen_at(twice.eyes[1], Channel::red, tangent);
  EXPECT_LT(glm::distance(2.0 * (small + 0.5), large + 0.5), 1e-9);
  EXPECT_EQ(scaled_to(hmd, 1280, 800).eyes[0].lens_centre_px, hmd.eyes[0].lens_centre_px);
}

TEST(Stereo, DisparityIsDistanceOfTheEyesByDepth_V4) {
  const HmdCalibration hmd = default_hmd_calibration();
  const RigidPose head{{0.1, -0.4, 0.5}, glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 0.2, 0.1)))};
  for (const double depth_m : {0.3, 0.5, 1.0, 5.0}) {
    const glm::dvec3 in_head(0.05, -0.03, -depth_m);
    const glm::dvec3 world = head.position + head.orientation * in_head;
    std::array<glm::dvec2, 2> pixel{};
    double focal_px = 0.0;
    for (std::size_t i = 0; i < 2; ++i) {
      Eye eye;
      eye.world_from_eye = compose(head, hmd.eyes[i].head_from_eye);
      eye.pinhole = undistorted_pinhole(hmd.eyes[i]);
      focal_px = eye.pinhole.fx_px;
      const glm::dvec3 seen(eye.eye_from_world() * glm::dvec4(world, 1.0));
      pixel[i] = project(eye.pinhole, {seen.x, -seen.y, -seen.z});
    }
    EXPECT_NEAR(pixel[0].x - pixel[1].x, focal_px * hmd.interpupillary_distance_m / depth_m, 1e-9);
    EXPECT_NEAR(pixel[0].y, pixel[1].y, 1e-9);
  }
}

TEST(Stereo, FilmAndSceneAgreeOnThePlaneOfTheFilm_V1) {
  const RigidPose camera{{0.02, -0.45, 0.40},
                         glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 0.1, -0.05)))};
  const RigidPose eye = compose(camera, {{-0.04, -0.03, 0.05}, glm::angleAxis(0.05, glm::dvec3(0, 1, 0))});
  constexpr double depth_m = 0.6;
  const auto seen_from = [](const RigidPose& pose, const glm::dvec3& world) {
    const glm::dvec3 local = glm::conjugate(pose.orientation) * (world - pose.position);
    return glm::dvec2(local.x, -local.y) / -local.z;
  };
  for (const double depth_there_m : {0.4, 0.6, 0.9}) {
    const glm::dvec3 world = camera.position + camera.orientation * glm::dvec3(0.07, 0.05, -depth_there_m);
    const glm::dvec3 ray = film_seen_from(eye, camera, depth_m) * glm::dvec3(seen_from(eye, world), 1.0);
    const double apart = glm::distance(glm::dvec2(ray) / ray.z, seen_from(camera, world));
    const double bound = 0.072 * std::abs(1.0 / depth_there_m - 1.0 / depth_m);
    if (depth_there_m == depth_m) {
      EXPECT_LT(apart, 1e-12);
    } else {
      EXPECT_GT(apart, 0.3 * bound);
      EXPECT_LT(apart, 1.5 * bound);
    }
  }
  // Infinitely far, and where the plane is behind the eye: the rotation alone.
  const glm::dmat3 far = film_seen_from(eye, camera, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(glm::determinant(far), 1.0, 1e-12);
  EXPECT_EQ(far, film_seen_from(eye, camera, -1.0));
  EXPECT_EQ(film_seen_from(camera, camera, depth_m), glm::dmat3(1.0));
}

}  // namespace
}  // namespace handloft::client
