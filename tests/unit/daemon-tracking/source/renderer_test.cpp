// The simulated cameras' pictures against other people's code: OpenCV's projection and libapriltag's
// detector.

#include "daemon-tracking/source/simulated/camera_renderer.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

namespace handloft::tracking {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double third_s = 0.002;

Exposure exposure_at(const HandProgram& program, double time) {
  return {program.at(time - third_s), program.at(time), program.at(time + third_s), HeadMotion{}.at(time)};
}

TEST(Lens, AgreesWithOpenCv) {
  for (const CameraCalibration& camera : default_rig().cameras) {
    const CameraIntrinsics& k = camera.intrinsics;
    const Lens lens(k);
    const cv::Matx33d matrix(k.fx_px, 0, k.cx_px, 0, k.fy_px, k.cy_px, 0, 0, 1);
    const std::vector<double> distortion(k.distortion.begin(), k.distortion.end());
    std::vector<cv::Point3d> points;
    for (double x = -0.5; x <= 0.5; x += 0.1) {
      for (double y = -0.38; y <= 0.38; y += 0.095) points.emplace_back(0.7 * x, 0.7 * y, 0.7);
    }
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), matrix, distortion, pixels);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto pixel = lens.project({points[i].x, points[i].y, points[i].z});
      ASSERT_TRUE(pixel.has_value());
      EXPECT_NEAR(pixel->x(), pixels[i].x, 1e-9);
      EXPECT_NEAR(pixel->y(), pixels[i].y, 1e-9);
      const Vector2d ray = lens.ray(*pixel);
      EXPECT_NEAR(ray.x(), points[i].x / points[i].z, 1e-9);
      EXPECT_NEAR(ray.y(), points[i].y / points[i].z, 1e-9);
    }
    EXPECT_FALSE(lens.project({0, 0, -1}).has_value());
  }
}

/// Mean and largest distance of detected from true corners, and which tags were found.
struct TagErrors {
  double sum = 0, largest = 0;
  int corners = 0;
  std::map<int, double> mean_by_id;
  double mean() const { return corners > 0 ? sum / corners : 1e9; }
};

TagErrors detect_tags(const ImagePlanes& image, const CameraRenderer& renderer, const Rig& rig,
                      const Exposure& exposure) {
  image_u8_t grey{image.width, image.height, image.width, const_cast<std::uint8_t*>(image.y.data())};
  apriltag_family_t* family = tag36h11_create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family_bits(detector, family, 1);
  detector->quad_decimate = 1.0f;
  zarray_t* found = apriltag_detector_detect(detector, &grey);
  const Eigen::Isometry3d camera_from_world = renderer.world_from_camera(exposure.world_from_head).inverse();
  TagErrors errors;
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found, i, &detection);
    const auto check = [&](const std::vector<TagPlacement>& tags, const Eigen::Isometry3d& world_from_body) {
      for (const TagPlacement& tag : tags) {
        if (tag.id != detection->id) continue;
        // libapriltag's corners: bottom left, bottom right, top right, top left; its pixel centres are at .5.
        const double h = tag.edge_m / 2;
        const Vector3d corners[4] = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
        double sum = 0;
        // A tag that is cut off by the picture's edge has no corners to speak of.
        const auto inside = [&](const double* p) {
          constexpr double margin_px = 8;
          return p[0] > margin_px && p[1] > margin_px && p[0] < image.width - margin_px &&
                 p[1] < image.height - margin_px;
        };
        if (!std::all_of(std::begin(detection->p), std::end(detection->p), inside)) continue;
        for (int c = 0; c < 4; ++c) {
          const auto pixel =
              renderer.lens().project(camera_from_world * world_from_body * tag.body_from_tag * corners[c]);
          if (!pixel) continue;
          const double error = (Vector2d(detection->p[c][0] - 0.5, detection->p[c][1] - 0.5) - *pixel).norm();
          sum += error;
          errors.largest = std::max(errors.largest, error);
        }
        errors.sum += sum;
        errors.corners += 4;
        errors.mean_by_id[tag.id] = sum / 4;
      }
    };
    check(rig.table_tags, Eigen::Isometry3d::Identity());
    check(rig.head_tags, exposure.world_from_head);
  }
  apriltag_detections_destroy(found);
  apriltag_detector_destroy(detector);
  tag36h11_destroy(family);
  return errors;
}

class RendererTags : public testing::TestWithParam<std::size_t> {};

TEST_P(RendererTags, AreFoundWithinHalfAPixelT5) {
  const Rig rig = default_rig();
  const HandProgram program = mouse_shell_program();
  CameraRenderer renderer(rig, GetParam(), ImageOptions{});
  for (const double time : {0.5, 18.0}) {
    const Exposure exposure = exposure_at(program, time);
    const TagErrors errors = detect_tags(renderer.draw(exposure, 3), renderer, rig, exposure);
    RecordProperty("corners", errors.corners);
    for (const auto& [id, mean] : errors.mean_by_id) {
      if (mean > 0.5) ADD_FAILURE() << "tag " << id << " off by " << mean << " px at " << time << " s";
    }
    EXPECT_LT(errors.mean(), 0.3);
    const bool table = rig.cameras[GetParam()].role == CameraRole::table;
    // The head looks over the hand, which covers some of the table's sheets.
    EXPECT_GE(errors.corners / 4, table ? 8 : 4) << "tags found at " << time << " s";
    if (table) {
      const auto head_tags = std::count_if(errors.mean_by_id.begin(), errors.mean_by_id.end(),
                                           [](const auto& entry) { return entry.first >= 20; });
      EXPECT_GE(head_tags, 2) << "of the head rig at " << time << " s";
    }
    std::printf("camera %zu at %.1f s: %d tags, corners off by %.3f px mean, %.3f max\n", GetParam(), time,
                errors.corners / 4, errors.mean(), errors.largest);
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, RendererTags, testing::Values(0u, 1u, 2u));

TEST(Renderer, CapsCentroidIsWhereItsCentreProjectsT6) {
  // Without noise and other colours near, by chroma: the pixel pairs whose chroma is nearer to the cap's than
  // to grey.
  const Rig rig = default_rig();
  const HandProgram program = mouse_shell_program();
  ImageOptions clean;
  clean.noise_luma = clean.noise_chroma = 0;
  for (std::size_t camera = 0; camera < 2; ++camera) {
    CameraRenderer renderer(rig, camera, clean);
    double sum = 0;
    int count = 0;
    for (const double time : {0.5, 4.4, 7.0, 9.3}) {
      const Exposure exposure = exposure_at(program, time);
      const ImagePlanes& image = renderer.draw(exposure, 1);
      const Eigen::Isometry3d camera_from_world =
          renderer.world_from_camera(exposure.world_from_head).inverse();
      for (std::size_t finger = 0; finger < finger_count; ++finger) {
        const auto truth = renderer.lens().project(camera_from_world * exposure.middle.fingertips_m[finger]);
        ASSERT_TRUE(truth.has_value());
        // Hidden by another finger's cap nearby: not this test's subject.
        bool clear = true;
        for (std::size_t other = 0; other < finger_count; ++other) {
          const auto at = renderer.lens().project(camera_from_world * exposure.middle.fingertips_m[other]);
          clear = clear && (other == finger || (*at - *truth).norm() > 16.0);
        }
        if (!clear) continue;
        const Vector2d colour(rig.colours[finger].cb - 128, rig.colours[finger].cr - 128);
        double weight_sum = 0;
        Vector2d weighted = Vector2d::Zero();
        for (int y = static_cast<int>(truth->y()) - 12; y <= static_cast<int>(truth->y()) + 12; ++y) {
          for (int x = static_cast<int>(truth->x()) / 2 - 6; x <= static_cast<int>(truth->x()) / 2 + 6; ++x) {
            const auto index = static_cast<std::size_t>(y * image.chroma_width() + x);
            const Vector2d seen(image.cb[index] - 128.0, image.cr[index] - 128.0);
            const double weight = std::clamp(seen.dot(colour) / colour.squaredNorm(), 0.0, 1.0);
            if (weight < 0.25) continue;
            weight_sum += weight;
            weighted += weight * Vector2d(2 * x + 0.5, y);
          }
        }
        // Partly hidden by a finger: the blob is smaller than the cap's disc (two pixels of a row share their
        // chroma).
        const double depth_m = (camera_from_world * exposure.middle.fingertips_m[finger]).z();
        const double radius_px = renderer.lens().intrinsics().fx_px * rig.fingertip_radius_m / depth_m;
        if (weight_sum < 0.8 * std::numbers::pi * radius_px * radius_px / 2) continue;
        const double error = (weighted / weight_sum - *truth).norm();
        EXPECT_LT(error, 1.0) << rig.cameras[camera].name << " finger " << finger << " at " << time;
        sum += error;
        ++count;
      }
    }
    ASSERT_GT(count, 6);
    std::printf("camera %zu: caps' centroids off by %.3f px mean of %d\n", camera, sum / count, count);
    EXPECT_LT(sum / count, 0.5);
  }
}

TEST(Renderer, NoiseHasItsSigmaAndKeyDecides) {
  const Rig rig = default_rig();
  ImageOptions clean, noisy;
  clean.noise_luma = clean.noise_chroma = 0;
  CameraRenderer quiet(rig, 2, clean), sensor(rig, 2, noisy);
  const Exposure exposure = exposure_at(mouse_shell_program(), 1.0);
  const ImagePlanes truth = quiet.draw(exposure, 1);
  const ImagePlanes first = sensor.draw(exposure, 7);
  const ImagePlanes again = sensor.draw(exposure, 7);
  const ImagePlanes other = sensor.draw(exposure, 8);
  EXPECT_EQ(first.y, again.y);
  EXPECT_NE(first.y, other.y);
  double squares = 0;
  for (std::size_t i = 0; i < truth.y.size(); ++i) {
    squares += (double{1} * first.y[i] - truth.y[i]) * (double{1} * first.y[i] - truth.y[i]);
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(truth.y.size())), noisy.noise_luma, 0.1);
}

TEST(Renderer, BytesAreAJpegOfTheCamerasSize) {
  const Rig rig = default_rig();
  CameraRenderer renderer(rig, 2, ImageOptions{});
  const auto jpeg = renderer.render(exposure_at(mouse_shell_program(), 1.0), 1);
  ASSERT_TRUE(jpeg.ok()) << jpeg.error().describe();
  tjhandle decoder = tjInitDecompress();
  int width = 0, height = 0, subsampling = -1, colours = -1;
  EXPECT_EQ(tjDecompressHeader3(decoder, jpeg->data(), jpeg->size(), &width, &height, &subsampling, &colours),
            0);
  tjDestroy(decoder);
  EXPECT_EQ(width, 640);
  EXPECT_EQ(height, 480);
  EXPECT_EQ(subsampling, TJSAMP_422);
}

TEST(DefaultRig, HuesAreWellApart) {
  const Rig rig = default_rig();
  for (std::size_t i = 0; i < finger_count; ++i) {
    const Vector2d a(rig.colours[i].cb, rig.colours[i].cr);
    EXPECT_GT((a - Vector2d(128, 128)).norm(), 60.0);  // Grey: glove, tags.
    EXPECT_GT((a - Vector2d(105, 150)).norm(), 60.0);  // Skin.
    for (std::size_t j = i + 1; j < finger_count; ++j) {
      EXPECT_GT((a - Vector2d(rig.colours[j].cb, rig.colours[j].cr)).norm(), 70.0);
    }
  }
}

TEST(DefaultRig, TagsLeaveThePaletteFree) {
  for (const TagPlacement& tag : default_rig().table_tags) {
    const double half = TagBitmap::sheet_edge_m(tag.edge_m) / 2;
    const Vector3d at = tag.body_from_tag.translation();
    for (double x = -half; x <= half; x += half / 4) {
      for (double y = -half; y <= half; y += half / 4) {
        for (int page = first_palette_page; page <= palette_pages; ++page) {
          EXPECT_FALSE(palette_command_at(at.x() + x, at.y() + y, page).has_value()) << "tag " << tag.id;
        }
      }
    }
  }
}

}  // namespace
}  // namespace handloft::tracking
