#pragma once
// The operations of a document, one file each: every function checks its message and makes the new document,
// or says what is wrong and makes none. They are called through apply() (document.h), which adds what all
// have in common.

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/model/document.h"
#include "server-model/model/reference_shape.h"

namespace handloft::model {

struct Outcome {
  Document document;
  handloft::v1::Operation effective;  ///< With ids and strokes resolved.
  std::string words;
  std::vector<std::string> notes;
};

Result<Outcome> create_dual_shape(const Document&, const handloft::v1::CreateDualShape&, const ApplyContext&);
Result<Outcome> add_points(const Document&, const handloft::v1::AddPoints&, const ApplyContext&);
Result<Outcome> set_symmetry(const Document&, const handloft::v1::SetSymmetry&, const ApplyContext&);
Result<Outcome> fit(const Document&, const handloft::v1::Fit&, const ApplyContext&);
Result<Outcome> refit_plane(const Document&, const handloft::v1::RefitPlane&, const ApplyContext&);
Result<Outcome> set_boundary(const Document&, const handloft::v1::SetBoundary&, const ApplyContext&);
Result<Outcome> set_superellipse(const Document&, const handloft::v1::SetSuperellipse&, const ApplyContext&);
Result<Outcome> set_representation(const Document&, const handloft::v1::SetRepresentation&,
                                   const ApplyContext&);
Result<Outcome> rename(const Document&, const handloft::v1::Rename&, const ApplyContext&);
Result<Outcome> delete_points(const Document&, const handloft::v1::DeletePoints&, const ApplyContext&);
Result<Outcome> move_points(const Document&, const handloft::v1::MovePoints&, const ApplyContext&);
Result<Outcome> transform_entities(const Document&, const handloft::v1::TransformEntities&,
                                   const ApplyContext&);
Result<Outcome> duplicate(const Document&, const handloft::v1::Duplicate&, const ApplyContext&);
Result<Outcome> delete_entity(const Document&, const handloft::v1::Delete&, const ApplyContext&);
Result<Outcome> push_points(const Document&, const handloft::v1::PushPoints&, const ApplyContext&);
Result<Outcome> modify_profile(const Document&, const handloft::v1::ModifyProfile&, const ApplyContext&);
/// Only with `resolved` filled; failed_precondition otherwise.
Result<Outcome> import_strokes(const Document&, const handloft::v1::ImportStrokes&, const ApplyContext&);

/// Only with `resolved` filled; failed_precondition otherwise.
Result<Outcome> import_reference(const Document&, const handloft::v1::ImportReference&, const ApplyContext&);
Result<Outcome> new_alternative(const Document&, const handloft::v1::NewAlternative&, const ApplyContext&);
Result<Outcome> switch_alternative(const Document&, const handloft::v1::SwitchAlternative&,
                                   const ApplyContext&);
Result<Outcome> restore_alternative(const Document&, const handloft::v1::RestoreAlternative&,
                                    const ApplyContext&);
Result<Outcome> delete_alternative(const Document&, const handloft::v1::DeleteAlternative&,
                                   const ApplyContext&);

Result<Outcome> create_sculpt_surface(const Document&, const handloft::v1::CreateSculptSurface&,
                                      const ApplyContext&);
Result<Outcome> set_sculpting(const Document&, const handloft::v1::SetSculpting&, const ApplyContext&);
Result<Outcome> add_icon(const Document&, const handloft::v1::AddIcon&, const ApplyContext&);
Result<Outcome> change_icon(const Document&, const handloft::v1::ChangeIcon&, const ApplyContext&);
Result<Outcome> drag_icon(const Document&, const handloft::v1::DragIcon&, const ApplyContext&);
Result<Outcome> delete_icon(const Document&, const handloft::v1::DeleteIcon&, const ApplyContext&);
Result<Outcome> commit_sculpting(const Document&, const handloft::v1::CommitSculpting&, const ApplyContext&);
Result<Outcome> recover_sculpting(const Document&, const handloft::v1::RecoverSculpting&,
                                  const ApplyContext&);
Result<Outcome> refine_surface(const Document&, const handloft::v1::RefineSurface&, const ApplyContext&);
/// Only with `resolved` filled; failed_precondition otherwise.
Result<Outcome> import_model(const Document&, const handloft::v1::ImportModel&, const ApplyContext&);

// These also keep who made them, and when.
Result<Outcome> name_version(const Document&, const handloft::v1::Operation&, const ApplyContext&);
Result<Outcome> restore_version(const Document&, const handloft::v1::RestoreVersion&, const ApplyContext&);
Result<Outcome> delete_version(const Document&, const handloft::v1::DeleteVersion&, const ApplyContext&);
Result<Outcome> add_comment(const Document&, const handloft::v1::Operation&, const ApplyContext&);
Result<Outcome> change_comment(const Document&, const handloft::v1::Operation&, const ApplyContext&);
Result<Outcome> delete_comment(const Document&, const handloft::v1::DeleteComment&, const ApplyContext&);

// --- shared by several operations ---

/// What a message asks to be shown. invalid_argument for anything but POINTS, SURFACE and BOTH.
Result<Representation> read_representation(handloft::v1::Representation representation,
                                           std::string_view field);

/// Shows the shape so, and its linked partner with it (A12); one without a surface is not shown as one.
void show(Document& document, std::string_view entity, Representation representation);

/// Puts a changed shape in the place of the former one of its id.
void put(Document& document, DualShape shape);

/// A mesh as messages hold it. Errors, below `field`: invalid_argument (counts, indices, numbers, no triangle
/// with an area), resource_exhausted.
Result<std::shared_ptr<const ReferenceMesh>> read_mesh(const handloft::v1::TriangleMesh& mesh,
                                                       const std::string& field, const Limits& limits);

/// The next free "<prefix>-N" of the document.
std::string free_id(const Document& document, std::string_view prefix);
/// The next free "shape-N" of the document.
std::string free_shape_id(const Document& document);
/// Counts on from an id of the form "shape-N": by the id alone, so that the log, which holds the id that was
/// found, leads to the same document.
void count_shape_id(Document& document, std::string_view id);

/// Marks an id as used and adds the entity. Errors: already_exists, resource_exhausted.
Status add_entity(Document& document, DualShape shape, std::string_view field, const Limits& limits);
Status add_entity(Document& document, EntityPtr entity, std::string_view field, const Limits& limits);

/// The index of the alternative of this name; not_found names the field.
Result<std::size_t> require_alternative(const Document& document, std::string_view name,
                                        std::string_view field);

/// The version of this name; not_found names the field.
Result<VersionPtr> require_version(const Document& document, std::string_view name, std::string_view field);

/// Adds points to a stroke, thinned (A1) and mirrored (A12) as the shape's symmetry says: on the first points
/// under Symmetry::partner the partner shape is made. `stroke` continues a stroke or is stroke_count + 1.
/// Appending in pieces gives the same as at once. O(points added). Errors: not_found, invalid_argument,
/// resource_exhausted.
Result<Document> extend_stroke(const Document& document, std::string_view entity, std::uint32_t stroke,
                               const std::vector<DualPoint>& points, double min_spacing_m,
                               const Limits& limits);

/// The linked partner of a shape, null when there is none (yet).
DualPtr linked_partner(const Document& document, const DualShape& shape);

/// Ends the shape's mirroring: its points and its partner stay as they are (A12).
void release_symmetry(Document& document, DualShape& shape);

}  // namespace handloft::model
