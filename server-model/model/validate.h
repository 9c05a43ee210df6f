#pragma once
// Checks that several operations share: ids, names, numbers, points and planes as they come over the wire.

#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/geometry/types.h"
#include "server-model/model/document.h"
#include "server-model/model/entity.h"
#include "server-model/model/limits.h"

namespace handloft::model {

/// Letters, digits, '-', '_' and '.', 1..max_id_bytes.
Status check_id(std::string_view id, std::string_view field, const Limits& limits);
/// UTF-8 without control characters, at most max_name_bytes; may be empty.
Status check_name(std::string_view name, std::string_view field, const Limits& limits);
/// UTF-8 without control characters but tabs and ends of lines, at most so many bytes; may be empty.
Status check_text(std::string_view text, std::size_t max_bytes, std::string_view field);
/// A finite coordinate within max_coordinate_m.
Status check_coordinate(double value, const std::string& field, const Limits& limits);
/// Three of them; absent is 0.
Result<geometry::Vec3> read_vector(const handloft::v1::Vec3& vector, const std::string& field,
                                   const Limits& limits);
/// Normalised; not `present`: none. invalid_argument for numbers that are not finite, or all 0.
Result<Eigen::Quaterniond> read_rotation(const handloft::v1::Quaternion& rotation, bool present,
                                         const std::string& field);
/// 0..max_degree; 0 stands for "as it is".
Status check_degree(std::uint32_t degree, std::string_view field, const Limits& limits);

/// The entity; not_found names the field and the id.
Result<EntityPtr> require_entity(const Document& document, std::string_view id, std::string_view field);
/// The entity, which must be a dual shape; invalid_argument when it is of another kind.
Result<DualPtr> require_dual(const Document& document, std::string_view id, std::string_view field);

/// The point with stroke and partner open. `field` is its path, "add_points.points[3]".
Result<DualPoint> read_point(const handloft::v1::Point& point, const std::string& field,
                             const Limits& limits);

/// The plane with its normal normalised.
Result<geometry::Plane> read_plane(const handloft::v1::Plane& plane, const std::string& field,
                                   const Limits& limits);

/// All points of a list; `field` is the path of the list. resource_exhausted beyond max_points_per_operation.
template <typename Points>
Result<std::vector<DualPoint>> read_points(const Points& points, const std::string& field,
                                           const Limits& limits) {
  const auto count = static_cast<std::size_t>(points.size());
  if (count > limits.max_points_per_operation) {
    return make_error(ErrorCode::resource_exhausted,
                      "found " + std::to_string(count) + " points, expected at most " +
                          std::to_string(limits.max_points_per_operation),
                      field);
  }
  std::vector<DualPoint> result;
  result.reserve(count);
  for (const auto& point : points) {
    // The path is only spelled out for a bad point.
    auto read = read_point(point, {}, limits);
    if (!read) {
      Error error = read.error();
      error.field = field + "[" + std::to_string(result.size()) + "]" + error.field;
      return error;
    }
    result.push_back(*read);
  }
  return result;
}

}  // namespace handloft::model
