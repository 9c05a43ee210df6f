#pragma once
// Golden views (V3): pictures of the whole client, each with a threshold of its own. golden_views_*.cpp hold
// the tables, golden_views_test.cpp draws and compares them.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client-hmd/render/frame.h"
#include "client-hmd/render/renderer.h"
#include "client-hmd/view/orbit_camera.h"

namespace handloft::client::test {

constexpr int view_width_px = 320, view_height_px = 200;

struct GoldenView {
  std::string name;  ///< Of the file in tests/data/golden/views, without ".png".
  std::function<Frame()> frame;
  double least_similarity = 0.985;  ///< SSIM of the luma, mean over 8x8 blocks.
  double largest_difference = 1.2;  ///< Mean absolute, of 255.
  Transparency transparency = Transparency::weighted_blended;
  double eye_distance_m = 0.0;  ///< Above 0: a pair of pictures, left and right.
};

/// One group is one test, so that ctest runs them side by side.
struct GoldenGroup {
  std::string name;
  std::vector<GoldenView> views;
};

std::vector<GoldenView> synthetic_views();
std::vector<GoldenView> gesture_views();
std::vector<GoldenView> ghost_views();
std::vector<GoldenView> film_views();
std::vector<GoldenView> transparency_views();
std::vector<GoldenView> mouse_views();
std::vector<GoldenView> seat_views();
std::vector<GoldenView> panel_views();
std::vector<GoldenView> sculpt_views();

/// A frame of `scene` from the usual place.
Frame usual_frame(std::shared_ptr<const Scene> scene);
/// As near as all of the scene allows, from that direction.
Frame fitted_frame(std::shared_ptr<const Scene> scene, double azimuth_rad, double elevation_rad);
/// From a place of one's own.
Frame frame_from(std::shared_ptr<const Scene> scene, const OrbitCamera& camera);

}  // namespace handloft::client::test
