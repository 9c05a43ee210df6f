#pragma once
// Reads STEP and IGES files back and looks at their faces: for tests, tools and checking what we exported.
// Not an editor.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange {

struct StepFace {
  std::string name;
  bool valid = false;        ///< BRepCheck_Analyzer finds nothing.
  bool is_bspline = false;   ///< The underlying surface is a B-spline (or Bezier).
  bool has_pcurves = false;  ///< All edges have curves in the parameter plane.
  int degree_u = 0, degree_v = 0;
  double area_m2 = 0;
  std::vector<geometry::Vec3> samples;   ///< Points inside the face, metres.
  std::vector<geometry::Vec3> boundary;  ///< Points along its edges, metres.
};

struct StepContent {
  std::vector<StepFace> faces;
  bool valid = false;  ///< The whole shape is.
  std::size_t solids = 0;
  std::size_t closed_shells = 0;
  std::size_t free_edges = 0;  ///< That one face alone has, once: 0 means watertight. Poles have no length.
};

struct StepReadOptions {
  int samples_per_side =
      20;  ///< Grid over the parameter box; points outside of the trimmed face are left out.
  int samples_per_edge = 50;
  std::size_t max_faces = 10000;
};

/// Errors: not_found, io, data_corrupt (not STEP, or no face in it), resource_exhausted.
Result<StepContent> read_step(const std::filesystem::path& path, const StepReadOptions& options = {});

/// The same of an IGES file; a face's name is its label.
Result<StepContent> read_iges(const std::filesystem::path& path, const StepReadOptions& options = {});

}  // namespace handloft::exchange
