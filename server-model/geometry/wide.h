#pragma once
// Four doubles at a time, for the loops of this room that decide its speed. The compiler lays them on
// whatever registers the target has; lanes never mix, so the width of the machine does not change a bit (X2).

namespace handloft::geometry {

inline constexpr int lanes = 4;
using Wide = double __attribute__((vector_size(lanes * sizeof(double))));

/// For containers: a vector type loses its attributes as a template argument.
struct alignas(lanes * sizeof(double)) Quad {
  Wide v = {0, 0, 0, 0};
};

}  // namespace handloft::geometry
