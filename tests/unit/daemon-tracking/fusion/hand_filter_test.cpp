#include "daemon-tracking/fusion/hand_filter.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/daemon-tracking/fusion/mocap_hand.h"

namespace handloft::tracking {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint start = from_ns(1'000'000'000);

/// Five tips 40 mm apart that glide at 100 mm/s.
Eigen::Vector3d tip_at(int finger, double time_s) {
  return {0.04 * (finger - 2) + 0.1 * time_s, 0.02 * (finger % 2), 0.03 - 0.05 * time_s};
}

class Hand : public ::testing::Test {
 protected:
  Hand() {
    for (const auto& camera : rig_.cameras) models_.push_back(CameraModel::create(camera.intrinsics).value());
  }
  CameraObservation see(std::uint32_t camera, int ms, std::vector<int> fingers = {0, 1, 2, 3, 4}) const {
    CameraObservation out;
    out.camera = camera;
    out.capture_time = start + milliseconds(ms);
    for (int finger : fingers) {
      FingertipBlob blob;
      blob.finger = static_cast<Finger>(finger);
      blob.centre_px = *models_[camera].project(rig_.cameras[camera].world_from_camera.inverse() *
                                                tip_at(finger, ms * 1e-3));
      blob.covariance = Eigen::Matrix2d::Identity() * 0.04;
      blob.area_px = 120;
      blob.log_likelihood.fill(-15.0);
      blob.log_likelihood[static_cast<std::size_t>(finger)] = 3.0;
      out.blobs.push_back(blob);
    }
    return out;
  }
  /// Two cameras in turn until `ms`.
  void watch(HandFilter& filter, int ms) const {
    for (int t = 0; t <= ms; t += 33) {
      ASSERT_TRUE(filter.update(see(0, t)).ok());
      if (t + 15 > ms) break;
      ASSERT_TRUE(filter.update(see(1, t + 15)).ok());
    }
  }
  const Rig rig_ = test::arc_rig(2);
  std::vector<CameraModel> models_;
};

TEST_F(Hand, FollowsAGlideT7) {
  auto filter = HandFilter::create(rig_).value();
  watch(filter, 400);
  const auto tips = filter.tips();
  for (int f = 0; f < finger_count; ++f) {
    const FusedTip& tip = tips[static_cast<std::size_t>(f)];
    EXPECT_EQ(tip.state, TrackingState::tracked);
    EXPECT_EQ(tip.camera_mask, 3u);
    EXPECT_LT((tip.position_m - tip_at(f, to_seconds(filter.newest() - start))).norm(), 0.4e-3);
    EXPECT_LT((tip.velocity_m_s - Eigen::Vector3d(0.1, 0, -0.05)).norm(), 0.03);
  }
}

TEST_F(Hand, StatesOfATipThatIsHiddenT6) {
  auto filter = HandFilter::create(rig_).value();
  watch(filter, 330);
  const auto state = [&] { return filter.tips()[1].state; };
  for (int t = 345; t <= 480; t += 33) ASSERT_TRUE(filter.update(see(1, t)).ok());
  EXPECT_EQ(state(), TrackingState::single);
  int last = 480;
  while (last < 600) {
    last += 33;
    ASSERT_TRUE(filter.update(see(0, last, {0, 2, 3, 4})).ok());
  }
  EXPECT_EQ(state(), TrackingState::predicted);
  for (; last < 760;) {
    last += 33;
    ASSERT_TRUE(filter.update(see(0, last, {0, 2, 3, 4})).ok());
  }
  EXPECT_EQ(state(), TrackingState::lost);
  EXPECT_TRUE(filter.tips()[1].position_m.allFinite());
}

TEST_F(Hand, ALateObservationGivesTheStateOfTheRightOrder) {
  auto in_order = HandFilter::create(rig_).value();
  auto late = HandFilter::create(rig_).value();
  watch(in_order, 330);
  watch(late, 330);
  const auto a = see(1, 345), b = see(0, 363);
  ASSERT_TRUE(in_order.update(a).ok() && in_order.update(b).ok());
  ASSERT_TRUE(late.update(b).ok() && late.update(a).ok());
  for (std::size_t f = 0; f < finger_count; ++f) {
    EXPECT_EQ(in_order.tips()[f].position_m, late.tips()[f].position_m);  // To the bit
    EXPECT_EQ(in_order.tips()[f].covariance_m2, late.tips()[f].covariance_m2);
  }
  EXPECT_EQ(late.counters().replayed, 1u);
  EXPECT_EQ(late.update(see(1, 250)).error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(late.counters().dropped, 1u);
}

TEST_F(Hand, AWrongBlobIsGatedAndAJumpIsFollowedInTheEnd) {
  auto filter = HandFilter::create(rig_).value();
  watch(filter, 330);
  auto wrong = see(1, 345);
  for (auto& blob : wrong.blobs)
    if (blob.finger == Finger::ring) blob.centre_px += Eigen::Vector2d(150, 0);
  ASSERT_TRUE(filter.update(wrong).ok());
  EXPECT_EQ(filter.counters().gated, 1u);
  EXPECT_LT((filter.tips()[3].position_m - tip_at(3, 0.345)).norm(), 2e-3);
}

TEST_F(Hand, TwoTipsNeverTakeOneBlob) {
  auto filter = HandFilter::create(rig_).value();
  watch(filter, 330);
  const auto before = filter.counters().updates;
  auto one = see(1, 345, {2});
  one.blobs[0].log_likelihood.fill(0.0);  // Could be any finger
  ASSERT_TRUE(filter.update(one).ok());
  EXPECT_EQ(filter.counters().updates, before + 1);
  EXPECT_LT((filter.tips()[2].position_m - tip_at(2, 0.345)).norm(), 1e-3);
}

TEST_F(Hand, PastFutureAndUnknownTimesT8) {
  auto filter = HandFilter::create(rig_).value();
  EXPECT_EQ(filter.at(Finger::index, start, {}).kind, ResultKind::lost);
  watch(filter, 400);
  const TipAt past = filter.at(Finger::index, start + milliseconds(300), {});
  EXPECT_EQ(past.kind, ResultKind::interpolated);
  EXPECT_LT((past.position_m - tip_at(1, 0.3)).norm(), 0.3e-3);
  EXPECT_EQ(filter.at(Finger::index, start + milliseconds(450), {}).kind, ResultKind::predicted);
  EXPECT_EQ(filter.at(Finger::index, start + milliseconds(900), {}).kind, ResultKind::lost);
  EXPECT_EQ(filter.at(Finger::index, start - milliseconds(900), {}).kind, ResultKind::lost);
}

TEST_F(Hand, NonsenseIsRefusedAndHarmless) {
  auto filter = HandFilter::create(rig_).value();
  watch(filter, 330);
  auto broken = see(1, 345);
  broken.blobs[0].centre_px.x() = std::numeric_limits<double>::quiet_NaN();
  broken.blobs[1].covariance.setZero();
  broken.blobs[2].log_likelihood.fill(std::numeric_limits<double>::quiet_NaN());
  ASSERT_TRUE(filter.update(broken).ok());
  for (const FusedTip& tip : filter.tips()) EXPECT_TRUE(tip.position_m.allFinite());
  auto unknown = see(1, 360);
  unknown.camera = 9;
  EXPECT_EQ(filter.update(unknown).error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace handloft::tracking
