#include "client-hmd/render/surface_shader.h"

namespace handloft::client {

const std::string_view surface_vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in float a_opacity;
layout(location = 3) in float a_distance;
layout(location = 4) in vec2 a_curvatures;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform int u_kind;  // CurvatureKind
#ifdef WIRES
out Vertex {
  vec3 world;
  vec3 normal;
  vec3 values;
  float eye_depth;
} to_geometry;
#define world to_geometry.world
#define normal to_geometry.normal
#define values to_geometry.values
#define eye_depth to_geometry.eye_depth
#else
out vec3 world;
out vec3 normal;
out vec3 values;  // opacity, distance, curvature
out float eye_depth;
#endif
void main() {
  vec4 in_eye = u_eye_from_world * vec4(a_position, 1.0);
  float product = a_curvatures.x * a_curvatures.y;
  float curvature = u_kind == 0   ? 0.5 * (a_curvatures.x + a_curvatures.y)
                    : u_kind == 1 ? sign(product) * sqrt(abs(product))
                    : u_kind == 2 ? a_curvatures.x
                                  : a_curvatures.y;
  world = a_position;
  normal = a_normal;
  values = vec3(a_opacity, a_distance, curvature);
  eye_depth = -in_eye.z;
  gl_Position = u_clip_from_eye * in_eye;
}
)glsl";

const std::string_view surface_wire_geometry_glsl = R"glsl(
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
in Vertex {
  vec3 world;
  vec3 normal;
  vec3 values;
  float eye_depth;
} corner[];
uniform vec2 u_viewport;
out vec3 world;
out vec3 normal;
out vec3 values;
out float eye_depth;
noperspective out vec3 to_edges;
void main() {
  // Behind the eye there is no picture to measure in: such a triangle has no lines.
  bool before = gl_in[0].gl_Position.w > 0.0 && gl_in[1].gl_Position.w > 0.0 && gl_in[2].gl_Position.w > 0.0;
  vec2 p[3];
  for (int i = 0; i < 3; ++i) p[i] = 0.5 * u_viewport * gl_in[i].gl_Position.xy / gl_in[i].gl_Position.w;
  float twice_area = abs((p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x));
  for (int i = 0; i < 3; ++i) {
    vec3 height = vec3(1e4);
    if (before) {
      height = vec3(0.0);
      height[i] = twice_area / max(distance(p[(i + 1) % 3], p[(i + 2) % 3]), 1e-4);
    }
    world = corner[i].world;
    normal = corner[i].normal;
    values = corner[i].values;
    eye_depth = corner[i].eye_depth;
    to_edges = height;
    gl_Position = gl_in[i].gl_Position;
    EmitVertex();
  }
  EndPrimitive();
}
)glsl";

const std::string_view surface_fragment_glsl = R"glsl(
in vec3 world;
in vec3 normal;
in vec3 values;
in float eye_depth;
#ifdef WIRES
noperspective in vec3 to_edges;
#endif
uniform vec3 u_eye_position;
uniform vec3 u_base;
uniform float u_gloss;
uniform float u_presence;    // Opacity of the whole thing.
uniform float u_range;       // Of the distances or curvatures shown.
uniform int u_look;          // Look of surface_pass.cpp
uniform float u_stripes;     // Of the mirrored room, from its one side to the other.
uniform float u_line_px;     // Width of the contour.
uniform vec3 u_line_colour;
uniform float u_trimmed;     // 1: nothing beyond the contour.
uniform float u_isophotes;   // Lines between the lamp and the shadow's edge; 0: none.
uniform sampler2D u_ramp;    // Colours from -range to range.
uniform sampler2D u_surroundings;
uniform vec4 u_surroundings_from_world;  // scale, offset of x and y; scale 0: none

// 1 on a line, 0 off it; `pixels` from its middle.
float line_at(float pixels, float width) {
  return 1.0 - smoothstep(0.5 * width - 0.5, 0.5 * width + 0.5, pixels);
}

// Mean of a square wave of period 1 over a pixel: its integral is a triangle wave, so that stripes finer than a
// pixel become grey instead of moire.
float striped(float at) {
  float pixel = max(fwidth(at), 1e-5);
  vec2 ends = at + vec2(-0.5, 0.5) * max(pixel, 0.02);
  vec2 lit = floor(ends) * 0.5 + min(fract(ends), 0.5);
  return mix((lit.y - lit.x) / max(pixel, 0.02), 0.5, smoothstep(0.7, 1.6, pixel));
}

// A room of long parallel lamps along y: what their reflections do on a surface is what an eye for cars looks at.
vec3 zebra(vec3 n, vec3 to_eye) {
  vec3 mirrored = reflect(-to_eye, n);
  float turn = atan(mirrored.x, abs(mirrored.z) + 1e-4) / 3.14159265 * u_stripes;
  float lit = striped(turn + 0.25);
  vec3 body = mix(vec3(0.018, 0.022, 0.030), vec3(0.80, 0.82, 0.84), lit);
  return body * (0.72 + 0.28 * clamp(dot(n, to_eye), 0.0, 1.0));
}

// Warm, matt, a little flatter than Lambert says, as wax is; with a broad dull shine.
vec3 clay(vec3 n, vec3 to_eye, float sky, float ground) {
  vec3 base = vec3(0.40, 0.245, 0.165);
  float facing = clamp(dot(n, to_eye), 0.0, 1.0);
  vec3 light = fill(n, sky, ground);
  return base * mix(light, vec3(dot(light, vec3(0.3333))), 0.15) * (0.90 + 0.22 * pow(1.0 - facing, 2.0)) +
         room(reflect(-to_eye, n), 0.60) * 0.022 * sky;
}

// Flakes of metal in deep lacquer under a polished coat.
vec3 car_paint(vec3 n, vec3 to_eye, vec3 base, float sky, float ground) {
  vec3 deep = pow(base, vec3(1.45)) * 0.75;
  vec3 mirrored = reflect(-to_eye, n);
  float facing = dot(n, to_eye);
  float open = mix(0.35, 1.0, sky);
  vec3 flakes = room(mirrored, 0.50) * mix(deep, base, 0.35);
  vec3 coat = room(mirrored, 0.012) * fresnel(facing, 0.055);
  return 0.55 * deep * fill(n, sky, ground) + open * (0.62 * flakes + coat);
}

vec3 silver(vec3 n, vec3 to_eye, float sky) {
  vec3 seen = room(reflect(-to_eye, n), 0.03);
  float facing = dot(n, to_eye);
  vec3 metal = mix(vec3(0.86, 0.87, 0.89), vec3(1.0), fresnel(facing, 0.0));
  seen = mix(seen, seen * seen * 1.15, 0.35);  // More contrast than a grey room has.
  return metal * seen * mix(0.35, 1.0, sky);
}

// Fine slanting lines as on the cut faces of a drawing: the back of a surface, whatever its colour. As far apart
// on the picture whatever the distance, by powers of two, between which they fade.
float hatching(float at, float pixel) {
  float level = log2(pixel * 9.0);
  float spacing = exp2(floor(level));
  float wide = abs(fract(at / (2.0 * spacing)) - 0.5) * 2.0 * spacing;
  float narrow = abs(fract(at / spacing) - 0.5) * spacing;
  float both = line_at(narrow / pixel, 1.3) * (1.0 - fract(level));
  return max(both, line_at(wide / pixel, 1.3));
}

void main() {
  vec3 to_eye = normalize(u_eye_position - world);
  vec3 n = normalize(normal);
  bool front = dot(n, to_eye) >= 0.0;
  float slope = max(fwidth(values.x), 1e-4);
  float slanting = (world.x + world.y + world.z) * 1000.0;
  float slanting_pixel = max(fwidth(slanting), 1e-6);
  float contour = line_at(abs(values.x - 0.5) / slope, u_line_px);
  float alpha = clamp(values.x, 0.0, 1.0);
  if (u_trimmed > 0.0) alpha = clamp((values.x - 0.5) / slope + 0.5, 0.0, 1.0);
  alpha = u_presence * max(alpha, 0.85 * contour);
  if (u_stage >= 3) {
    emit(vec3(0.0), alpha, eye_depth);
    return;
  }
  if (u_stage == 0 && alpha < as_good_as_opaque) discard;
  if (u_stage != 0 && alpha >= as_good_as_opaque) discard;
  skip_what_is_drawn();

  vec3 facing_normal = front ? n : -n;
  float sky = 1.0, ground = 1.0;
  if (u_surroundings_from_world.x > 0.0) {
    // Something above a place beside it, on the side that it looks to, takes light from it. As far beside as the
    // map is blurred, so that what is steep does not take its own.
    vec2 beside = world.xy + facing_normal.xy * max(0.045, 0.012 / u_surroundings_from_world.x);
    vec4 above = texture(u_surroundings, beside * u_surroundings_from_world.x + u_surroundings_from_world.yz);
    float top = above.b / max(above.r, 0.05);
    float over = smoothstep(0.004, 0.060, top - world.z - 0.012 * max(facing_normal.z, 0.0));
    // What is upright sees past what is above it.
    float lying = smoothstep(0.15, 0.55, abs(facing_normal.z));
    sky = 1.0 - 0.62 * lying * over * smoothstep(0.15, 0.75, above.r);
    ground = 1.0 - 0.75 * above.a * exp(-max(world.z, 0.0) / 0.10);
  }
  vec3 base = front ? u_base : u_base * 0.80;
  float gloss = front ? u_gloss : 0.30 * u_gloss;
  vec3 lit;
  if (u_look == 3) {
    lit = zebra(facing_normal, to_eye);
  } else if (u_look == 4 || u_look == 5) {
    float share = clamp((u_look == 4 ? values.y : values.z) / u_range, -1.0, 1.0);
    base = texture(u_ramp, vec2(share * (127.0 / 256.0) + 0.5, 0.5)).rgb;
    lit = satin(facing_normal, to_eye, base, 0.10, sky, ground);
    if (u_look == 5) {
      // A line at every fifth of the range.
      float steps = values.z / u_range * 5.0;
      float pixels = abs(fract(steps - 0.5) - 0.5) / max(fwidth(steps), 1e-5);
      lit *= 1.0 - 0.30 * line_at(pixels, 1.0) * step(abs(values.z), u_range) * (1.0 - smoothstep(0.15, 0.4, fwidth(steps)));
    }
  } else if (!front) {
    lit = satin(facing_normal, to_eye, base, gloss, sky, ground);
  } else if (u_look == 1) {
    lit = car_paint(facing_normal, to_eye, base, sky, ground);
  } else if (u_look == 2) {
    lit = silver(facing_normal, to_eye, sky);
  } else if (u_look == 6) {
    lit = clay(facing_normal, to_eye, sky, ground);
  } else {
    lit = satin(facing_normal, to_eye, base, gloss, sky, ground);
  }
  if (!front && u_look != 3 && u_look != 4) lit *= 1.0 - 0.16 * hatching(slanting, slanting_pixel);
  if (u_isophotes > 0.0) {
    float turn = acos(clamp(dot(facing_normal, vec3(-0.20, -0.34, 0.919)), -1.0, 1.0)) / 1.5707963 * u_isophotes;
    float pixel = max(fwidth(turn), 1e-5);
    lit = mix(lit, vec3(0.02, 0.03, 0.05), 0.75 * line_at(abs(fract(turn - 0.5) - 0.5) / pixel, 1.2) * (1.0 - smoothstep(0.15, 0.4, pixel)));
  }
#ifdef WIRES
  float nearest = min(min(to_edges.x, to_edges.y), to_edges.z);
  lit = mix(lit, vec3(0.015, 0.03, 0.06), 0.55 * line_at(nearest, u_line_px));
#endif
  lit = mix(lit, u_line_colour, 0.80 * contour);
  emit(lit, alpha, eye_depth);
}
)glsl";

}  // namespace handloft::client
