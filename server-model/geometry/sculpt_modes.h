#pragma once
// The movements that cost no sculpting energy (D3): of the functions 1, u, v and u v those whose derivatives
// all terms of the energy leave out and that vanish where control points are held. Constants where there is
// a membrane; all linear functions, or with no twist term also u v, where there is none. Other ones (an
// energy that bends in one direction only, creases without a membrane) the factorisation finds and refuses.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "server-model/geometry/knot_vector.h"
#include "server-model/geometry/sculpt_energy.h"

namespace handloft::geometry {

/// Their control values at `unknowns` (ascending; all other control points are held): a column each,
/// orthonormal, none where the surface is held.
Eigen::MatrixXd free_modes(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy,
                           const std::vector<std::uint32_t>& unknowns);
/// Of a curve, with alpha |w_u|^2 + beta |w_uu|^2.
Eigen::MatrixXd free_modes(const KnotVector& knots, double alpha, double beta,
                           const std::vector<std::uint32_t>& unknowns);

/// As many unknowns as there are modes (columns), ascending: where ties pin them best.
std::vector<std::uint32_t> tie_points(const Eigen::MatrixXd& modes);

}  // namespace handloft::geometry
