#pragma once
// A filmed desk with a hand over it, as pictures of the real renderer need it: painted, not photographed, so
// that everything in it is where it is said to be. Deterministic.

#include <algorithm>
#include <cmath>

#include "client-hmd/render/frame.h"
#include "tests/integration/client-hmd/ghost_scene.h"

namespace handloft::client::test {

/// A webcam on the forehead, half a metre over the table and looking at its middle.
inline Pinhole film_camera() {
  Pinhole camera;
  camera.width_px = 640;
  camera.height_px = 400;
  camera.fx_px = camera.fy_px = 620.0;
  camera.cx_px = 318.4;
  camera.cy_px = 202.1;
  camera.distortion = {-0.09, 0.03, 0.0002, -0.0001, 0.0};
  return camera;
}

inline RigidPose film_pose() {
  // OpenCV axes: x right, y down, z forward.
  const glm::dvec3 place(0.02, -0.36, 0.40), target(0.01, -0.01, 0.03);
  const glm::dvec3 ahead = glm::normalize(target - place);
  const glm::dvec3 right = glm::normalize(glm::cross(ahead, glm::dvec3(0.0, 0.0, 1.0)));
  return {place, glm::quat_cast(glm::dmat3(right, glm::cross(ahead, right), ahead))};
}

/// The hand that the film shows: from the right, over the middle.
inline FilmedHand filmed_hand_at(const glm::vec3& tips) {
  FilmedHand hand;
  hand.tips = tips_at(tips, 2.3F);
  return hand;
}

/// Wood, a sheet of paper, and the hand's skin with a shade at its edges.
inline std::shared_ptr<const Image> painted_film(const FilmedHand& hand) {
  const Pinhole camera = film_camera();
  const RigidPose pose = film_pose();
  auto film = std::make_shared<Image>(Image{camera.width_px, camera.height_px, {}});
  film->rgba.resize(4 * static_cast<std::size_t>(camera.width_px) *
                    static_cast<std::size_t>(camera.height_px));
  const auto put = [&](int x, int y, double r, double g, double b) {
    const std::size_t at = 4 * static_cast<std::size_t>(y * camera.width_px + x);
    const auto byte = [](double v) { return static_cast<std::uint8_t>(std::clamp(v, 0.0, 255.0)); };
    film->rgba[at] = byte(r);
    film->rgba[at + 1] = byte(g);
    film->rgba[at + 2] = byte(b);
    film->rgba[at + 3] = 255;
  };
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const double grain = 10.0 * std::sin(0.045 * y + 0.6 * std::sin(0.011 * x)) + 0.02 * x;
      const bool paper = x > 120 && x < 420 && y > 90 && y < 330;
      paper ? put(x, y, 222 + 0.02 * y, 220 + 0.02 * y, 212)
            : put(x, y, 132 + grain, 102 + grain, 74 + grain);
    }
  }
  const std::vector<Bone> bones =
      estimate_hand(hand.tips, hand.posture, glm::vec3(pose.position) - glm::vec3(0, 0, 0.25F)).bones;
  for (const double shade : {0.0, 1.0}) {  // First a dark rim, then the skin over it.
    for (const Bone& bone : bones) {
      constexpr int steps = 40;
      for (int i = 0; i <= steps; ++i) {
        const float share = static_cast<float>(i) / steps;
        const glm::dvec3 in_camera = glm::conjugate(pose.orientation) *
                                     (glm::dvec3(bone.from + share * (bone.to - bone.from)) - pose.position);
        if (in_camera.z < 0.05) continue;
        const glm::dvec2 at = project(camera, in_camera);
        const double radius =
            static_cast<double>(bone.from_radius_m + share * (bone.to_radius_m - bone.from_radius_m)) *
                camera.fx_px / in_camera.z +
            (shade > 0.0 ? 0.0 : 1.5);
        for (int y = std::max(0, static_cast<int>(at.y - radius));
             y <= std::min(camera.height_px - 1, static_cast<int>(at.y + radius)); ++y) {
          for (int x = std::max(0, static_cast<int>(at.x - radius));
               x <= std::min(camera.width_px - 1, static_cast<int>(at.x + radius)); ++x) {
            if (glm::distance(at, glm::dvec2(x, y)) > radius) continue;
            shade > 0.0 ? put(x, y, 205, 160, 136) : put(x, y, 120, 84, 68);
          }
        }
      }
    }
  }
  return film;
}

/// Of `scene`, over that film.
inline Frame filmed_frame(std::shared_ptr<const Scene> scene, const FilmedHand& hand, int width_px,
                          int height_px) {
  static std::uint64_t serial = 1000;
  Frame frame;
  frame.scene = std::move(scene);
  frame.eye.world_from_eye = eye_from_camera_axes(film_pose());
  frame.eye.pinhole = covering_pinhole(film_camera(), width_px, height_px);
  frame.film = FilmedPicture{painted_film(hand), ++serial, film_camera()};
  frame.filmed_hand = hand;
  return frame;
}

}  // namespace handloft::client::test
