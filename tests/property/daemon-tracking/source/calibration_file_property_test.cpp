// What is written as a calibration file is read again (T2, T11), whatever the values.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "daemon-tracking/source/calibration_file.h"

namespace handloft::tracking {
namespace {

double number(double low, double high) {
  return low + (high - low) * (*rc::gen::inRange(0, 1 << 30)) / double{1 << 30};
}

std::string any_text() {
  return *rc::gen::container<std::string>(rc::gen::inRange<char>(' ', '\x7f'));
}

Eigen::Isometry3d any_pose() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const Eigen::Quaterniond turn(number(-1, 1) + 1.5, number(-1, 1), number(-1, 1), number(-1, 1));
  pose.linear() = turn.normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(number(-3, 3), number(-3, 3), number(-3, 3));
  return pose;
}

std::map<std::string, StepResult> any_results() {
  std::map<std::string, StepResult> results;
  for (const char* step : {"intrinsics", "extrinsics", "time"})
    if (*rc::gen::arbitrary<bool>())
      results[step] = {*rc::gen::element(Verdict::good, Verdict::usable, Verdict::bad), number(0, 3), "px",
                       "2026-11-22T12:20:00Z", any_text()};
  return results;
}

std::array<FingertipColour, finger_count> any_colours() {
  std::array<FingertipColour, finger_count> colours;
  for (std::size_t i = 0; i < colours.size(); ++i)
    colours[i] = {static_cast<Finger>(i), number(0, 255), number(0, 255),
                  number(0, 255),         number(1, 40),  number(1, 40)};
  return colours;
}

Calibration any_calibration() {
  Calibration calibration = calibration_of(default_rig());
  calibration.date = any_text().substr(0, 60);
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    CameraRecord& record = calibration.cameras[i];
    CameraCalibration& camera = calibration.rig.cameras[i];
    record.device = {any_text(), any_text(), any_text()};
    record.format = *rc::gen::element(PixelFormat::mjpeg, PixelFormat::yuyv, PixelFormat::grey);
    record.frames_per_s = number(5, 120);
    camera.row_time = Duration(*rc::gen::inRange(-30000, 30000));
    if (*rc::gen::arbitrary<bool>()) record.controls.focus = *rc::gen::inRange(0, 255);
    if (*rc::gen::arbitrary<bool>()) record.controls.exposure_100us = *rc::gen::inRange(1, 300);
    if (*rc::gen::arbitrary<bool>()) record.colours = any_colours();
    record.results = any_results();
    camera.time_offset = Duration(*rc::gen::inRange(-20'000'000, 20'000'000));
    camera.intrinsics.fx_px = number(200, 2000);
    for (double& k : camera.intrinsics.distortion) k = number(-1, 1);
    (camera.role == CameraRole::table ? camera.world_from_camera : camera.head_from_camera) = any_pose();
  }
  for (TagPlacement& tag : calibration.rig.head_tags) tag.body_from_tag = any_pose();
  if (*rc::gen::arbitrary<bool>())
    calibration.glove = GloveRanges{
        {any_text(), any_text(), ""}, number(0, 100), number(200, 1023), number(0, 50), number(700, 1023)};
  calibration.results = any_results();
  return calibration;
}

void assert_same(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  RC_ASSERT(a.translation() == b.translation());
  RC_ASSERT((a.linear() - b.linear()).norm() < 1e-14);
}

void assert_same(const Calibration& a, const Calibration& b) {
  RC_ASSERT(a.date == b.date);
  RC_ASSERT(a.results == b.results);
  RC_ASSERT(a.glove == b.glove);
  RC_ASSERT(a.cameras.size() == b.cameras.size());
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    const CameraRecord &left = a.cameras[i], &right = b.cameras[i];
    RC_ASSERT(left.device == right.device);
    RC_ASSERT(left.format == right.format);
    RC_ASSERT(left.frames_per_s == right.frames_per_s);
    RC_ASSERT(left.controls == right.controls);
    RC_ASSERT(left.results == right.results);
    RC_ASSERT(left.colours.has_value() == right.colours.has_value());
    for (std::size_t finger = 0; left.colours && finger < left.colours->size(); ++finger) {
      const FingertipColour &p = (*left.colours)[finger], &q = (*right.colours)[finger];
      RC_ASSERT(p.y == q.y && p.cb == q.cb && p.cr == q.cr && p.sigma_cb == q.sigma_cb &&
                p.sigma_cr == q.sigma_cr);
    }
    const CameraCalibration &camera = a.rig.cameras[i], &again = b.rig.cameras[i];
    RC_ASSERT(camera.name == again.name);
    RC_ASSERT(camera.role == again.role);
    RC_ASSERT(camera.time_offset == again.time_offset);
    RC_ASSERT(camera.row_time == again.row_time);
    RC_ASSERT(camera.intrinsics.fx_px == again.intrinsics.fx_px);
    RC_ASSERT(camera.intrinsics.cy_px == again.intrinsics.cy_px);
    RC_ASSERT(camera.intrinsics.distortion == again.intrinsics.distortion);
    assert_same(camera.world_from_camera, again.world_from_camera);
    assert_same(camera.head_from_camera, again.head_from_camera);
  }
  RC_ASSERT(a.rig.head_tags.size() == b.rig.head_tags.size());
  for (std::size_t i = 0; i < a.rig.head_tags.size(); ++i) {
    RC_ASSERT(a.rig.head_tags[i].id == b.rig.head_tags[i].id);
    RC_ASSERT(a.rig.head_tags[i].edge_m == b.rig.head_tags[i].edge_m);
    assert_same(a.rig.head_tags[i].body_from_tag, b.rig.head_tags[i].body_from_tag);
  }
}

TEST(CalibrationFileProperty, T11ReadsWhatItWrote) {
  EXPECT_TRUE(rc::check([] {
    const Calibration calibration = any_calibration();
    const Result<std::string> text = format_calibration(calibration);
    RC_ASSERT(text.ok());
    const Result<Calibration> again = parse_calibration(*text, "test.toml");
    if (!again) RC_FAIL(again.error().describe());
    assert_same(calibration, *again);
  }));
}

TEST(CalibrationFileProperty, T11ACutOrChangedFileIsReadOrRefusedNeverWrong) {
  EXPECT_TRUE(rc::check([] {
    std::string text = format_calibration(any_calibration()).value();
    const auto at = *rc::gen::inRange<std::size_t>(0, text.size());
    if (*rc::gen::arbitrary<bool>()) {
      text.resize(at);
    } else {
      text[at] = *rc::gen::arbitrary<char>();
    }
    const Result<Calibration> read = parse_calibration(text, "test.toml");
    if (read) {
      RC_ASSERT(check_calibration(*read).ok());
    } else {
      RC_ASSERT(read.error().field.starts_with("test.toml"));
    }
  }));
}

}  // namespace
}  // namespace handloft::tracking
