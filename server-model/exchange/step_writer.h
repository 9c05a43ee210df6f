#pragma once
// STEP (ISO 10303-21) through Open CASCADE: every fitted surface is a true B-spline face (never facets),
// trimmed at the half-opaque contour by a boundary with curves in the parameter plane (A26, X3), valid by
// BRepCheck, in millimetres. Stars (exponents below 1) end where their arms get thinner than
// contour_curve.h's min_tip_width_m, 10 micrometres. One product per surface carries its name.
// Locale-independent; nothing is printed.

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange {

struct StepOptions {
  std::string author;        ///< FILE_NAME's author; empty leaves it out.
  std::string organization;  ///< FILE_NAME's organization.
  /// Largest distance of the boundary from the superellipse's contour, as a fraction of its size: 1e-7 is 10
  /// nm on a hand-sized part, below STEP readers' usual 1e-7 m.
  double contour_tolerance = 1e-7;
  std::function<void(const BorderGap& gap)> on_gap;  ///< Told of neighbours in models that came apart.
};

/// Writes the surfaces to `path`, whole or not at all. Errors: invalid_argument for no surface or one that
/// makes no valid face ("surfaces[2]"); io as in write_file_atomically(). May be called from any thread;
/// calls queue, since the library's settings are global.
Status write_step(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                  const StepOptions& options = {});

/// The same with faces and models beside them; their errors are invalid_argument too ("faces[1].surface",
/// "models[0].replaced[2]"), data_corrupt for a stored model that is damaged, failed_precondition for one of
/// which no face is left.
Status write_step(const std::filesystem::path& path, const CadContent& content,
                  const StepOptions& options = {});

/// What write_step() writes. The header names the file by `file_name`.
Result<std::string> step_text(const std::string& file_name, const CadContent& content,
                              const StepOptions& options = {});

}  // namespace handloft::exchange
