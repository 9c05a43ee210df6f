#pragma once
// The GLSL of SurfacePass: materials, mirrored stripes, curvature's colours, and the lines over a surface.

#include <string_view>

namespace handloft::client {

extern const std::string_view surface_vertex_glsl;
/// Passes every triangle on with its corners' distances from the opposite edges in pixels (Baerentzen et al.,
/// "Single-pass wireframe rendering", SIGGRAPH 2006), for lines of constant width. Only while wires are
/// shown.
extern const std::string_view surface_wire_geometry_glsl;
extern const std::string_view surface_fragment_glsl;

}  // namespace handloft::client
