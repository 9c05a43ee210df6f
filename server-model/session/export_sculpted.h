#pragma once
// Sculpted surfaces and imported models as the exporters take them: faces for CAD, triangles for the rest.

#include <string>
#include <vector>

#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/surface_export.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/document.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// The imported model whose face the surface is; null when it is none's, or that one is no more.
CadModelPtr model_of_face(const Document& document, const SculptShape& face);

/// The present surface within its trim, or, with Trim::box, the whole of it.
exchange::CadFace to_cad_face(const SculptShape& shape, exchange::Trim trim);

/// The model with its faces as they are sculpted now, less those that were deleted.
exchange::ModelExport to_cad_model(const Document& document, const CadModel& model);

/// Tells of neighbours that came apart, the widest gaps first, of each model at most 16. `models` are those
/// that were exported, in their order.
void note_gaps(const Document& document, const std::vector<CadModelPtr>& models,
               const std::vector<exchange::BorderGap>& gaps, std::vector<std::string>& notes);

/// Triangles of the present surface, a tenth of a millimetre from it, or 1/50,000 of its size where that is
/// more. Errors: as geometry::tessellate().
Result<exchange::MeshExport> to_mesh(const SculptPtr& shape, exchange::Trim trim);

/// Of a model, whose size counts then: its other faces as they were imported, and each sculptable one.
Result<std::vector<exchange::MeshExport>> to_meshes(const Document& document, const CadModel& model);

}  // namespace handloft::model
