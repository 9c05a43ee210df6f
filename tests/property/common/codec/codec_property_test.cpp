// Round trips of the codecs for whatever mesh and cloud: within half a step.

#include <gtest/gtest.h>
// gtest first: RapidCheck's header does not include it.
#include <rapidcheck/gtest.h>

#include <cmath>

#include "common/codec/mesh_codec.h"
#include "common/codec/point_codec.h"

namespace handloft::codec {
namespace {

double metres() {
  return *rc::gen::inRange(-1'000'000, 1'000'001) * 1.7e-6;
}

RC_GTEST_PROP(CodecProperty, a_mesh_comes_back_within_half_a_step, ()) {
  MeshData mesh;
  const int vertices = *rc::gen::inRange(1, 600);
  for (int i = 0; i < vertices; ++i) {
    mesh.positions.push_back(
        {static_cast<float>(metres()), static_cast<float>(metres()), static_cast<float>(metres())});
    const double azimuth = metres();
    const double height = std::sin(metres());
    const double radius = std::sqrt(1.0 - height * height);
    mesh.normals.push_back({static_cast<float>(radius * std::cos(azimuth)),
                            static_cast<float>(radius * std::sin(azimuth)), static_cast<float>(height)});
    mesh.opacity.push_back(static_cast<std::uint8_t>(*rc::gen::inRange(0, 256)));
  }
  const int triangles = *rc::gen::inRange(0, 200);
  for (int i = 0; i < 3 * triangles; ++i) {
    mesh.indices.push_back(static_cast<std::uint32_t>(*rc::gen::inRange(0, vertices)));
  }
  mesh.row = static_cast<std::uint32_t>(*rc::gen::inRange(0, vertices + 1));
  const auto message = encode_mesh(mesh);
  RC_ASSERT(message.ok());
  const auto back = decode_mesh(*message);
  RC_ASSERT(back.ok());
  RC_ASSERT(back->opacity == mesh.opacity);
  RC_ASSERT(back->indices.size() == mesh.indices.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    double cosine = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double error =
          static_cast<double>(back->positions[i][axis]) - static_cast<double>(mesh.positions[i][axis]);
      RC_ASSERT(std::abs(error) <= 0.5 * message->step_m() + 2e-7);  // and a float's rounding at 1.7 m
      cosine += static_cast<double>(back->normals[i][axis]) * static_cast<double>(mesh.normals[i][axis]);
    }
    RC_ASSERT(cosine > std::cos(1.0 * M_PI / 180.0));
  }
  const auto plain = as_vertex_streams(*message);
  RC_ASSERT(plain.ok());
  const auto same = decode_mesh(*plain);
  RC_ASSERT(same.ok());
  RC_ASSERT(same->positions == back->positions);
  RC_ASSERT(same->normals == back->normals);
  RC_ASSERT(same->opacity == back->opacity);
}

RC_GTEST_PROP(CodecProperty, a_cloud_comes_back_within_half_a_step_in_whatever_pieces, ()) {
  PointTail whole;
  whole.total = static_cast<std::uint32_t>(*rc::gen::inRange(0, 200));
  const int styles = *rc::gen::inRange(1, 20);
  for (int i = 0; i < styles; ++i) whole.palette.push_back({i / 20.0, 0.01F, {}, {}});
  for (std::uint32_t i = 0; i < whole.total; ++i) {
    whole.positions.push_back({metres(), metres(), metres()});
    whole.styles.push_back(static_cast<std::uint16_t>(*rc::gen::inRange(0, styles)));
  }
  PointTail held;
  while (held.total < whole.total) {
    const auto begin = held.total;
    const auto end = static_cast<std::uint32_t>(
        *rc::gen::inRange(static_cast<int>(begin) + 1, static_cast<int>(whole.total) + 1));
    PointTail piece{end,
                    begin,
                    {whole.positions.begin() + begin, whole.positions.begin() + end},
                    {whole.styles.begin() + begin, whole.styles.begin() + end},
                    whole.palette};
    const auto message = encode_points(piece);
    RC_ASSERT(message.ok());
    const auto decoded = decode_points(*message);
    RC_ASSERT(decoded.ok());
    RC_ASSERT(merge_points(held, *decoded).ok());
  }
  RC_ASSERT(held.positions.size() == whole.positions.size());
  for (std::size_t i = 0; i < whole.positions.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      RC_ASSERT(std::abs(held.positions[i][axis] - whole.positions[i][axis]) <= 0.5e-6 + 1e-15);
    }
    RC_ASSERT(held.palette[held.styles[i]].pressure == whole.palette[whole.styles[i]].pressure);
  }
}

}  // namespace
}  // namespace handloft::codec
