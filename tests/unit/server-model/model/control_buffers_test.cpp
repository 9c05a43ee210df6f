// Memory of control points comes back when nobody shows them any more, and to shapes of the same size alone.

#include "server-model/model/control_buffers.h"

#include <gtest/gtest.h>

#include <optional>

namespace handloft::model {
namespace {

geometry::BSplineSurface with_points(std::size_t count) {
  const geometry::KnotVector line = geometry::KnotVector::open(1, {0, 0, 1, 1}).value();
  return {line, line, std::vector<geometry::Vec3>(count, geometry::Vec3::Ones()), {}};
}

TEST(ControlBuffers, StayWithTheLastOwner) {
  ControlBuffers buffers;
  auto surface = buffers.share(with_points(4));
  const auto also = surface;
  surface.reset();
  EXPECT_TRUE(buffers.take(4).empty()) << "still shown";
  EXPECT_EQ(also->control.size(), 4U);
}

TEST(ControlBuffers, GoToShapesOfTheSameSize) {
  std::optional<ControlBuffers> buffers(std::in_place);
  auto surface = buffers->share(with_points(4));
  const geometry::Vec3* const memory = surface->control.data();
  surface.reset();
  EXPECT_TRUE(buffers->take(5).empty());
  EXPECT_EQ(buffers->take(4).data(), memory);
  EXPECT_TRUE(buffers->take(4).empty()) << "taken";
  surface = buffers->share(with_points(4));
  buffers.reset();
  surface.reset();  // Outlives the buffers.
}

}  // namespace
}  // namespace handloft::model
