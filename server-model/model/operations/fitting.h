#pragma once
// Fitting as several operations do it (A5 - A10): what a fit leaves behind, its mirror image, and what there
// is to note about it. Defined in fit.cpp.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"
#include "server-model/model/document.h"

namespace handloft::model {

enum class BasePlane : std::uint8_t { frozen, taken_anew };

/// Fits the shape's points; frozen: in the frame of its present fit, if it has one. Errors: rank_deficient,
/// or as geometry::fit_polynomial_surface().
Result<std::shared_ptr<const FittedSurface>> fit_points(const DualShape& shape, std::uint32_t degree,
                                                        BasePlane base_plane);

/// How the degree of a fit is found.
struct DegreeChoice {
  std::uint32_t degree = 2;          ///< To be fitted; with `automatic`, the highest to be tried.
  bool automatic = false;            ///< By cross-validation (automatic_degree.h).
  std::uint32_t already_chosen = 0;  ///< What `automatic` came to when the log was written; 0: open.
};

/// The same with a degree that may be open; requested_degree of the result is what was chosen.
Result<std::shared_ptr<const FittedSurface>> fit_points(const DualShape& shape, const DegreeChoice& choice,
                                                        BasePlane base_plane);

/// Makes it the shape's fit. The first one shows the surface beside the points.
void take_fit(DualShape& shape, std::shared_ptr<const FittedSurface> fit, std::uint32_t degree);

/// Fits a fitted shape again in its frozen frame with the degree it has, and its linked partner with it (A9,
/// A12): what operations do that change points and are to refit. Errors: those of fit_points(), with `field`.
Status refit(Document& document, std::string_view entity, std::string_view field,
             std::vector<std::string>& notes);

/// Whether all points of both came in pairs, so that the one is the mirror image of the other.
bool mirror_images(const DualShape& shape, const DualShape& partner);
/// Whether the frozen frames of both fits are mirror images too; they aren't where both were fitted while
/// other points belonged to them. True where one has no fit.
bool mirror_frames(const DualShape& shape, const DualShape& partner);
/// The surface of the mirrored points, without fitting them: the same to the bit but for the frame (A12).
std::shared_ptr<FittedSurface> mirror_image(const FittedSurface& fit, const geometry::Plane& plane);

/// The angle between the normals of the frozen frame and of a fresh one of the points, 0..pi/2 (A10).
double frame_drift_rad(const geometry::Frame& frozen, const std::vector<geometry::WeightedPoint>& points);

/// Whether all numbers are, so that they may go into a document.
bool finite(const FittedSurface& fit);

/// Says in words when the degree was lowered (A7) or the base plane has drifted (A10).
void note_fit(const DualShape& shape, std::vector<std::string>& notes);

}  // namespace handloft::model
