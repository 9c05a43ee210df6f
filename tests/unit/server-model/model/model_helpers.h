#pragma once
// Short ways to write operations and documents down in tests.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "proto/operation.pb.h"
#include "proto/query.pb.h"
#include "server-model/model/canonical.h"
#include "server-model/model/document.h"
#include "server-model/model/model.h"

namespace handloft::model::test {

namespace v1 = handloft::v1;

inline v1::Operation create(const std::string& id, std::uint32_t degree = 0) {
  v1::Operation operation;
  operation.mutable_create_dual_shape()->set_id(id);
  operation.mutable_create_dual_shape()->set_degree(degree);
  return operation;
}

inline v1::Point point(double x, double y, double z, double pressure = 1.0) {
  v1::Point result;
  result.mutable_position()->set_x(x);
  result.mutable_position()->set_y(y);
  result.mutable_position()->set_z(z);
  result.set_pressure(pressure);
  return result;
}

inline v1::Operation add(const std::string& id, const std::vector<v1::Point>& points,
                         std::uint32_t stroke = 0) {
  v1::Operation operation;
  auto& request = *operation.mutable_add_points();
  request.set_entity(id);
  request.set_stroke(stroke);
  for (const auto& one : points) *request.add_points() = one;
  return operation;
}

/// Points of z = 0.01 + 2 x^2 - y^2 over a 6 by 5 grid of centimetres, x from `x_from`.
inline std::vector<v1::Point> saddle_points(double x_from = -0.025) {
  std::vector<v1::Point> points;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 5; ++j) {
      const double x = x_from + 0.01 * i;
      const double y = -0.02 + 0.01 * j;
      points.push_back(point(x, y, 0.01 + 2 * x * x - y * y, 0.25 + 0.02 * (i + j)));
    }
  }
  return points;
}

inline v1::Operation fit(const std::string& id, std::uint32_t degree = 0) {
  v1::Operation operation;
  operation.mutable_fit()->set_entity(id);
  operation.mutable_fit()->set_degree(degree);
  return operation;
}

inline v1::Operation refit_plane(const std::string& id) {
  v1::Operation operation;
  operation.mutable_refit_plane()->set_entity(id);
  return operation;
}

/// Mirrors at the plane through (x, 0, 0) across the x axis.
inline v1::Operation symmetry(const std::string& id, v1::SetSymmetry::Mode mode, double x = 0.0) {
  v1::Operation operation;
  auto& request = *operation.mutable_set_symmetry();
  request.set_entity(id);
  request.set_mode(mode);
  if (mode != v1::SetSymmetry::OFF) {
    request.mutable_plane()->mutable_origin()->set_x(x);
    request.mutable_plane()->mutable_normal()->set_x(2.0);
  }
  return operation;
}

inline v1::Operation superellipse(const std::string& id, double exponent) {
  v1::Operation operation;
  operation.mutable_set_superellipse()->set_entity(id);
  operation.mutable_set_superellipse()->set_exponent(exponent);
  return operation;
}

inline v1::Operation represent(const std::string& id, v1::Representation representation) {
  v1::Operation operation;
  operation.mutable_set_representation()->set_entity(id);
  operation.mutable_set_representation()->set_representation(representation);
  return operation;
}

inline v1::Operation rename(const std::string& id, const std::string& name) {
  v1::Operation operation;
  operation.mutable_rename()->set_entity(id);
  operation.mutable_rename()->set_name(name);
  return operation;
}

inline v1::Operation remove(const std::string& id) {
  v1::Operation operation;
  operation.mutable_delete_()->set_entity(id);
  return operation;
}

inline v1::Operation undo() {
  v1::Operation operation;
  operation.mutable_undo();
  return operation;
}

inline v1::Operation redo() {
  v1::Operation operation;
  operation.mutable_redo();
  return operation;
}

/// Applies operations one after the other; a refused one fails the test.
inline Document applied(Document document, const std::vector<v1::Operation>& operations) {
  for (const auto& operation : operations) {
    auto result = apply(document, operation);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().describe());
    if (result) document = std::move(result->document);
  }
  return document;
}

inline void expect_refused(const Document& document, const v1::Operation& operation, ErrorCode code,
                           const std::string& field, const ApplyContext& context = {}) {
  const std::string before = document_hash(document);
  const auto result = apply(document, operation, context);
  ASSERT_FALSE(result.ok()) << operation.ShortDebugString();
  EXPECT_EQ(result.error().code, code) << result.error().describe();
  EXPECT_EQ(result.error().field, field) << result.error().describe();
  EXPECT_FALSE(result.error().message.empty());
  EXPECT_EQ(document_hash(document), before);
}

}  // namespace handloft::model::test
