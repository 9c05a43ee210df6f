// The small parts of the session: latency figures, presence, failures on the wire, reports.

#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "common/codec/fingertips.h"
#include "server-model/session/latency.h"
#include "server-model/session/presence.h"
#include "server-model/session/remote_target.h"
#include "server-model/session/report.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;

TEST(LatencyTest, median_and_99th_are_within_a_bin_and_the_largest_exact) {
  LatencyHistogram histogram;
  for (int i = 1; i <= 1000; ++i) histogram.add(i * 10us);
  const LatencySummary summary = histogram.summary();
  EXPECT_EQ(summary.count, 1000U);
  EXPECT_NEAR(summary.median_ms, 5.0, 0.05 * 5.0);
  EXPECT_NEAR(summary.p99_ms, 9.9, 0.05 * 9.9);
  EXPECT_DOUBLE_EQ(summary.max_ms, 10.0);
}

TEST(LatencyTest, nothing_and_absurd_durations_are_harmless) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.summary().median_ms, 0.0);
  histogram.add(-5s);
  histogram.add(24h);
  EXPECT_EQ(histogram.summary().count, 2U);
  EXPECT_DOUBLE_EQ(histogram.summary().max_ms, 24 * 3600 * 1000.0);
}

TEST(PresenceTest, bad_numbers_become_lost_and_good_ones_stay) {
  v1::Presence presence;
  codec::Fingertips tips;
  for (codec::FingertipRecord& tip : tips) {
    tip.state = v1::TRACKING_TRACKED;
    tip.position_m = {0.25, 0.0, 0.0};
    tip.covariance_m2.fill(1.0F);
  }
  tips[1].velocity_m_s[2] = std::numeric_limits<float>::infinity();
  codec::pack_fingertips(tips, *presence.mutable_hand());
  presence.mutable_hand()->set_pressure(std::numeric_limits<double>::quiet_NaN());
  const v1::Presence clean = clean_presence(presence);
  const auto kept = codec::unpack_fingertips(clean.hand());
  ASSERT_TRUE(kept.ok());
  EXPECT_EQ((*kept)[0].state, v1::TRACKING_TRACKED);
  EXPECT_EQ((*kept)[0].position_m[0], 0.25);
  EXPECT_TRUE(clean.hand().fingertip_covariances().empty());
  EXPECT_EQ((*kept)[1].state, v1::TRACKING_LOST);
  EXPECT_EQ(clean.hand().pressure(), 0.0);
  presence.mutable_hand()->add_fingertip_positions(1.0);
  const v1::Presence again = clean_presence(presence);
  for (const int state : again.hand().fingertip_states()) EXPECT_EQ(state, v1::TRACKING_LOST);
}

TEST(PresenceTest, long_names_are_cut_between_characters) {
  v1::Presence presence;
  std::string name = "x";
  for (int i = 0; i < 200; ++i) name += "é";  // two bytes each, so that 256 would split one
  presence.set_name(name);
  const std::string cut = clean_presence(presence).name();
  EXPECT_EQ(cut.size(), 255U);
  EXPECT_EQ(cut, name.substr(0, 255));
}

TEST(FailureTest, every_code_survives_the_wire) {
  for (int code = 0; code <= static_cast<int>(ErrorCode::internal); ++code) {
    v1::Failure failure;
    set_failure(failure, make_error(static_cast<ErrorCode>(code), "what", "points[3]"));
    const Error error = to_error(failure);
    EXPECT_EQ(error.code, static_cast<ErrorCode>(code));
    EXPECT_EQ(error.field, "points[3]");
  }
  v1::Failure unknown;
  unknown.set_code("from_the_future");
  EXPECT_EQ(to_error(unknown).code, ErrorCode::internal);
}

TEST(ReportTest, is_json_also_with_names_that_are_not_utf8) {
  auto shape = std::make_shared<model::DualShape>();
  shape->id = "top";
  shape->name = "T\xff";
  SessionFigures figures;
  figures.state.document.entities["top"] = shape;
  const auto json = nlohmann::json::parse(report_json(figures));
  EXPECT_EQ(json["entity_count"], 1);
  EXPECT_EQ(json["entities"][0]["id"], "top");
  EXPECT_EQ(json["entities"][0]["fitted"], false);
}

}  // namespace
}  // namespace handloft::session
