// T11 CHECK: Debian's opencv-doc chessboard pairs. Our lenses fit no worse than OpenCV's calibrateCamera, our
// rig no worse than stereoCalibrate, on the same corners in the same run.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "daemon-tracking/calibration/extrinsics.h"
#include "daemon-tracking/calibration/intrinsics.h"

namespace handloft::tracking {
namespace {

namespace fs = std::filesystem;

const fs::path folder = "/usr/share/doc/opencv-doc/examples/data";
constexpr int width = 640, height = 480;
/// OpenCV tells no size; squares of 25 mm are assumed by its sample. Only ratios matter here.
constexpr ChessboardShape shape{9, 6, 0.025};

Plane grey(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<unsigned char> bytes((std::istreambuf_iterator<char>(in)), {});
  Plane plane{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width * height))};
  tjhandle handle = tjInitDecompress();
  const int bad = tjDecompress2(handle, bytes.data(), bytes.size(), plane.samples.data(), width, 0, height,
                                TJPF_GRAY, TJFLAG_ACCURATEDCT);
  tjDestroy(handle);
  EXPECT_EQ(bad, 0) << path;
  return plane;
}

struct Pairs {
  std::vector<BoardView> views[2];
};

Pairs load() {
  Pairs pairs;
  BoardFinder finder = BoardFinder::create(Board::chess(shape)).value();
  for (int i = 1; i <= 14; ++i) {
    const fs::path left = folder / fmt::format("left{:02}.jpg", i),
                   right = folder / fmt::format("right{:02}.jpg", i);
    if (!fs::exists(left) || !fs::exists(right)) continue;
    auto a = finder.find(grey(left), 0, from_ns(i * 1'000'000'000LL), left.filename());
    auto b = finder.find(grey(right), 1, from_ns(i * 1'000'000'000LL), right.filename());
    if (!a || !b) continue;
    pairs.views[0].push_back(std::move(*a));
    pairs.views[1].push_back(std::move(*b));
  }
  return pairs;
}

std::vector<std::vector<cv::Point3f>> points_of(const std::vector<BoardView>& views) {
  std::vector<std::vector<cv::Point3f>> all;
  for (const BoardView& view : views) {
    auto& points = all.emplace_back();
    for (const auto& corner : view.corners) {
      const Eigen::Vector3f p = corner.point_m.cast<float>();
      points.emplace_back(p.x(), p.y(), p.z());
    }
  }
  return all;
}

std::vector<std::vector<cv::Point2f>> pixels_of(const std::vector<BoardView>& views) {
  std::vector<std::vector<cv::Point2f>> all;
  for (const BoardView& view : views) {
    auto& pixels = all.emplace_back();
    for (const auto& corner : view.corners) {
      const Eigen::Vector2f p = corner.pixel.cast<float>();
      pixels.emplace_back(p.x(), p.y());
    }
  }
  return all;
}

/// OpenCV works in single precision for points; ours sees the same numbers.
std::vector<BoardView> rounded(std::vector<BoardView> views) {
  for (BoardView& view : views)
    for (auto& corner : view.corners) {
      corner.pixel = corner.pixel.cast<float>().cast<double>();
      corner.point_m = corner.point_m.cast<float>().cast<double>();
    }
  return views;
}

struct OpenCvLens {
  cv::Mat matrix, distortion;
  double rms_px = 0;
};

OpenCvLens opencv_lens(const std::vector<BoardView>& views) {
  OpenCvLens lens;
  std::vector<cv::Mat> turns, shifts;
  lens.rms_px =
      cv::calibrateCamera(points_of(views), pixels_of(views), {width, height}, lens.matrix, lens.distortion,
                          turns, shifts, 0, {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-12});
  return lens;
}

IntrinsicsOptions all_views() {
  IntrinsicsOptions options;
  options.max_edge_width_px = 100;
  options.refuse_view_rms_px = 100;
  options.min_different_px = 0;
  options.huber_sigmas = std::numeric_limits<double>::infinity();
  return options;
}

cv::Mat matrix_of(const CameraIntrinsics& lens) {
  return (cv::Mat_<double>(3, 3) << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1);
}
cv::Mat distortion_of(const CameraIntrinsics& lens) {
  return (cv::Mat_<double>(1, 5) << lens.distortion[0], lens.distortion[1], lens.distortion[2],
          lens.distortion[3], lens.distortion[4]);
}
cv::Mat mat_of(const Eigen::Matrix3d& m) {
  cv::Mat out(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out.at<double>(r, c) = m(r, c);
  return out;
}

/// RMS distance in rows between the two images of a corner after rectification: what stereo matching feels.
double rectification_error_px(const cv::Mat& m1, const cv::Mat& d1, const cv::Mat& m2, const cv::Mat& d2,
                              const cv::Mat& turn, const cv::Mat& shift, const std::vector<BoardView>& left,
                              const std::vector<BoardView>& right) {
  cv::Mat r1, r2, p1, p2, q;
  cv::stereoRectify(m1, d1, m2, d2, {width, height}, turn, shift, r1, r2, p1, p2, q);
  double sum = 0;
  std::size_t count = 0;
  const auto a = pixels_of(left), b = pixels_of(right);
  for (std::size_t view = 0; view < a.size(); ++view) {
    std::vector<cv::Point2f> ua, ub;
    cv::undistortPoints(a[view], ua, m1, d1, r1, p1);
    cv::undistortPoints(b[view], ub, m2, d2, r2, p2);
    for (std::size_t i = 0; i < ua.size(); ++i, ++count) sum += std::pow(ua[i].y - ub[i].y, 2);
  }
  return std::sqrt(sum / static_cast<double>(count));
}

TEST(StereoPairs, T11LensesFitNoWorseThanCalibrateCamera) {
  if (!fs::exists(folder / "left01.jpg")) GTEST_SKIP() << "Debian's opencv-doc is not installed";
  const Pairs pairs = load();
  ASSERT_GE(pairs.views[0].size(), 12U);
  for (const int side : {0, 1}) {
    const std::vector<BoardView> views = rounded(pairs.views[side]);
    const OpenCvLens theirs = opencv_lens(views);
    const auto ours = calibrate_intrinsics(views, width, height, all_views());
    ASSERT_TRUE(ours.ok()) << ours.error().describe();
    ASSERT_EQ(ours->used.size(), views.size());
    RecordProperty(fmt::format("camera{}", side),
                   fmt::format("ours {:.6f} px, calibrateCamera {:.6f} px", ours->rms_px, theirs.rms_px));
    fmt::print(
        "{}: ours {:.6f} px, calibrateCamera {:.6f} px; focal {:.2f} +- {:.2f} against {:.2f}; {} views, "
        "tilt {:.0f}, coverage {:.2f}: {} {}\n",
        side, ours->rms_px, theirs.rms_px, ours->lens.fx_px, ours->sigmas[0], theirs.matrix.at<double>(0, 0),
        views.size(), ours->tilt_deg, ours->coverage, to_string(ours->result.verdict), ours->result.words);
    EXPECT_LE(ours->rms_px, theirs.rms_px + 1e-6);
    EXPECT_NEAR(ours->lens.fx_px, theirs.matrix.at<double>(0, 0), ours->sigmas[0]);
    // As it is used, bad views may go: the rest fits better, and says the same lens.
    const auto usual = calibrate_intrinsics(views, width, height);
    ASSERT_TRUE(usual.ok()) << usual.error().describe();
    EXPECT_LE(usual->rms_px, theirs.rms_px + 1e-6);
    EXPECT_NEAR(usual->lens.fx_px, theirs.matrix.at<double>(0, 0), 5 * ours->sigmas[0]);
    fmt::print("   usual: {:.4f} px {} views focal {:.2f}\n", usual->rms_px, usual->used.size(),
               usual->lens.fx_px);
  }
}

TEST(StereoPairs, T11TheRigIsNoWorseThanStereoCalibrate) {
  if (!fs::exists(folder / "left01.jpg")) GTEST_SKIP() << "Debian's opencv-doc is not installed";
  const Pairs pairs = load();
  const std::vector<BoardView> left = rounded(pairs.views[0]), right = rounded(pairs.views[1]);
  ASSERT_GE(left.size(), 12U);
  const auto lens_left = calibrate_intrinsics(left, width, height, all_views());
  const auto lens_right = calibrate_intrinsics(right, width, height, all_views());
  ASSERT_TRUE(lens_left.ok() && lens_right.ok());
  const cv::Mat m1 = matrix_of(lens_left->lens), d1 = distortion_of(lens_left->lens),
                m2 = matrix_of(lens_right->lens), d2 = distortion_of(lens_right->lens);

  struct Figures {
    double baseline_m, sigma_m, rms_px, rectification_px;
  };
  const auto ours_of = [&](Hold lenses) {
    ExtrinsicsInput input;
    input.names = {"left", "right"};
    input.lenses = {lens_left->lens, lens_right->lens};
    input.views = left;
    input.views.insert(input.views.end(), right.begin(), right.end());
    MomentOptions every;
    every.other_place_px = 0;
    input.moments = shared_moments(input.views, every);
    EXPECT_EQ(input.moments.size(), left.size());
    ExtrinsicsOptions options;
    options.lenses = lenses;
    options.huber_sigmas = 1e9;
    options.refuse_view_rms_px = 100;
    const auto made = calibrate_extrinsics(input, options);
    EXPECT_TRUE(made.ok()) << made.error().describe();
    const Eigen::Isometry3d right_from_left =
        made->world_from_camera[1].inverse() * made->world_from_camera[0];
    const Eigen::Vector3d t = right_from_left.translation();
    const cv::Mat shift = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
    return Figures{t.norm(), made->sigmas[1].head<3>().norm(), made->rms_px / std::sqrt(1.0),
                   rectification_error_px(matrix_of(made->lenses[0]), distortion_of(made->lenses[0]),
                                          matrix_of(made->lenses[1]), distortion_of(made->lenses[1]),
                                          mat_of(right_from_left.linear()), shift, left, right)};
  };
  const auto theirs_of = [&](int flags) {
    cv::Mat a = m1.clone(), b = d1.clone(), c = m2.clone(), d = d2.clone(), turn, shift, essential,
            fundamental;
    const double fit = cv::stereoCalibrate(points_of(left), pixels_of(left), pixels_of(right), a, b, c, d,
                                           {width, height}, turn, shift, essential, fundamental, flags,
                                           {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12});
    return Figures{cv::norm(shift), 0, fit, rectification_error_px(a, b, c, d, turn, shift, left, right)};
  };
  for (const auto& [name, ours, theirs] :
       {std::tuple{"lenses fixed", ours_of(Hold::fixed), theirs_of(cv::CALIB_FIX_INTRINSIC)},
        std::tuple{"lenses refined", ours_of(Hold::free), theirs_of(cv::CALIB_USE_INTRINSIC_GUESS)}}) {
    fmt::print(
        "{}: baseline ours {:.3f} +- {:.3f} mm, stereoCalibrate {:.3f} mm; rms {:.7f} and {:.7f} px; "
        "rectification {:.7f} and {:.7f} px\n",
        name, 1e3 * ours.baseline_m, 1e3 * ours.sigma_m, 1e3 * theirs.baseline_m, ours.rms_px, theirs.rms_px,
        ours.rectification_px, theirs.rectification_px);
    EXPECT_LE(ours.rms_px, theirs.rms_px + 1e-6) << name;
    EXPECT_NEAR(ours.baseline_m, theirs.baseline_m, 0.0002) << name;
    EXPECT_LE(ours.rectification_px, theirs.rectification_px + 5e-4) << name;
  }
}

}  // namespace
}  // namespace handloft::tracking
