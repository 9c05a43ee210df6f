#pragma once
// A sheet to sculpt, and operations written as the scripts write them.

#include <gtest/gtest.h>

#include <google/protobuf/util/json_util.h>

#include <string>

#include "proto/operation.pb.h"
#include "server-model/model/model.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::model::test {

namespace v1 = handloft::v1;

inline v1::Operation operation(const std::string& json) {
  v1::Operation message;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &message);
  EXPECT_TRUE(status.ok()) << status.ToString() << "\n" << json;
  return message;
}

/// A model with a flat sheet "hood", 0.4 x 0.3 m in z = 0, of 12 x 10 control points.
class Sculpting : public testing::Test {
 protected:
  void SetUp() override {
    apply(R"({"create_sculpt_surface": {"id": "hood", "rectangle": {"width_m": 0.4, "depth_m": 0.3},
              "control_u": 12, "control_v": 10}})");
  }

  Submitted apply(const std::string& json) {
    auto submitted = model.submit(operation(json));
    EXPECT_TRUE(submitted.ok()) << json << "\n" << (submitted ? "" : submitted.error().describe());
    return submitted ? *submitted : Submitted{};
  }
  Error refused(const std::string& json) {
    const Document before = model.document();
    auto submitted = model.submit(operation(json));
    EXPECT_FALSE(submitted.ok()) << json;
    EXPECT_TRUE(difference(before, model.document()).empty()) << "a refused operation changes nothing";
    return submitted ? Error{} : submitted.error();
  }
  SculptPtr hood() const { return as_sculpt(model.document().find("hood")); }
  const SculptIcon& icon(const std::string& id) const { return *hood()->find_icon(id); }
  geometry::Vec3 at(double u, double v) const { return hood()->surface->evaluate(u, v); }
  /// Largest distance of a control point from rest.
  double bulge() const {
    double most = 0;
    for (std::size_t i = 0; i < hood()->surface->control.size(); ++i) {
      most = std::max(most, (hood()->surface->control[i] - hood()->rest->control[i]).norm());
    }
    return most;
  }

  Model model;
};

}  // namespace handloft::model::test
