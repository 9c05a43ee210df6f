#include "server-model/model/document.h"

#include <algorithm>

#include "server-model/model/annotations.h"
#include "server-model/model/operations/operations.h"

namespace handloft::model {

namespace v1 = handloft::v1;

EntityPtr Document::find(std::string_view id) const {
  const auto found = entities.find(id);
  return found == entities.end() ? nullptr : found->second;
}

std::vector<std::string> Changes::all() const {
  std::vector<std::string> ids = created;
  ids.insert(ids.end(), changed.begin(), changed.end());
  ids.insert(ids.end(), removed.begin(), removed.end());
  std::sort(ids.begin(), ids.end());
  return ids;
}

namespace {

bool alike(const Alternatives& a, const Alternatives& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Alternative& x, const Alternative& y) {
    return x.name == y.name && x.entities == y.entities && x.version == y.version;
  });
}

}  // namespace

Changes difference(const Document& before, const Document& after) {
  Changes changes;
  changes.alternatives =
      before.present != after.present ||
      (before.alternatives != after.alternatives && !alike(*before.alternatives, *after.alternatives));
  changes.versions = before.versions != after.versions && *before.versions != *after.versions;
  changes.comments = before.comments != after.comments && *before.comments != *after.comments;
  auto a = before.entities.begin();
  auto b = after.entities.begin();
  while (a != before.entities.end() || b != after.entities.end()) {
    if (b == after.entities.end() || (a != before.entities.end() && a->first < b->first)) {
      changes.removed.push_back(a->first);
      ++a;
    } else if (a == before.entities.end() || b->first < a->first) {
      changes.created.push_back(b->first);
      ++b;
    } else {
      if (a->second != b->second) changes.changed.push_back(a->first);
      ++a;
      ++b;
    }
  }
  return changes;
}

namespace {

Error not_for_a_document(const char* what) {
  return make_error(ErrorCode::failed_precondition, what);
}

Result<Outcome> dispatch(const Document& document, const v1::Operation& operation,
                         const ApplyContext& context) {
  switch (operation.body_case()) {
    case v1::Operation::kCreateDualShape:
      return create_dual_shape(document, operation.create_dual_shape(), context);
    case v1::Operation::kAddPoints:
      return add_points(document, operation.add_points(), context);
    case v1::Operation::kSetSymmetry:
      return set_symmetry(document, operation.set_symmetry(), context);
    case v1::Operation::kFit:
      return fit(document, operation.fit(), context);
    case v1::Operation::kRefitPlane:
      return refit_plane(document, operation.refit_plane(), context);
    case v1::Operation::kSetSuperellipse:
      return set_superellipse(document, operation.set_superellipse(), context);
    case v1::Operation::kSetBoundary:
      return set_boundary(document, operation.set_boundary(), context);
    case v1::Operation::kSetRepresentation:
      return set_representation(document, operation.set_representation(), context);
    case v1::Operation::kRename:
      return rename(document, operation.rename(), context);
    case v1::Operation::kDelete:
      return delete_entity(document, operation.delete_(), context);
    case v1::Operation::kDeletePoints:
      return delete_points(document, operation.delete_points(), context);
    case v1::Operation::kMovePoints:
      return move_points(document, operation.move_points(), context);
    case v1::Operation::kTransform:
      return transform_entities(document, operation.transform(), context);
    case v1::Operation::kDuplicate:
      return duplicate(document, operation.duplicate(), context);
    case v1::Operation::kImportStrokes:
      return import_strokes(document, operation.import_strokes(), context);
    case v1::Operation::kPushPoints:
      return push_points(document, operation.push_points(), context);
    case v1::Operation::kModifyProfile:
      return modify_profile(document, operation.modify_profile(), context);
    case v1::Operation::kImportReference:
      return import_reference(document, operation.import_reference(), context);
    case v1::Operation::kNewAlternative:
      return new_alternative(document, operation.new_alternative(), context);
    case v1::Operation::kSwitchAlternative:
      return switch_alternative(document, operation.switch_alternative(), context);
    case v1::Operation::kRestoreAlternative:
      return restore_alternative(document, operation.restore_alternative(), context);
    case v1::Operation::kDeleteAlternative:
      return delete_alternative(document, operation.delete_alternative(), context);
    case v1::Operation::kCreateSculptSurface:
      return create_sculpt_surface(document, operation.create_sculpt_surface(), context);
    case v1::Operation::kSetSculpting:
      return set_sculpting(document, operation.set_sculpting(), context);
    case v1::Operation::kAddIcon:
      return add_icon(document, operation.add_icon(), context);
    case v1::Operation::kChangeIcon:
      return change_icon(document, operation.change_icon(), context);
    case v1::Operation::kDragIcon:
      return drag_icon(document, operation.drag_icon(), context);
    case v1::Operation::kDeleteIcon:
      return delete_icon(document, operation.delete_icon(), context);
    case v1::Operation::kCommitSculpting:
      return commit_sculpting(document, operation.commit_sculpting(), context);
    case v1::Operation::kRecoverSculpting:
      return recover_sculpting(document, operation.recover_sculpting(), context);
    case v1::Operation::kRefineSurface:
      return refine_surface(document, operation.refine_surface(), context);
    case v1::Operation::kImportModel:
      return import_model(document, operation.import_model(), context);
    case v1::Operation::kNameVersion:
      return name_version(document, operation, context);
    case v1::Operation::kRestoreVersion:
      return restore_version(document, operation.restore_version(), context);
    case v1::Operation::kDeleteVersion:
      return delete_version(document, operation.delete_version(), context);
    case v1::Operation::kAddComment:
      return add_comment(document, operation, context);
    case v1::Operation::kChangeComment:
      return change_comment(document, operation, context);
    case v1::Operation::kDeleteComment:
      return delete_comment(document, operation.delete_comment(), context);
    case v1::Operation::kUndo:
    case v1::Operation::kRedo:
      return not_for_a_document("undo and redo belong to a model's history");
    case v1::Operation::kExport:
      return not_for_a_document("an export changes no document");
    case v1::Operation::BODY_NOT_SET:
      break;
  }
  return make_error(ErrorCode::invalid_argument, "found no operation that this build knows, expected one");
}

/// Comments on what is gone stay at its last place. What is only in another alternative than the one that is
/// worked on now is not gone.
void leave_comments(const Document& before, const Changes& changes, Document& after) {
  if (changes.removed.empty() || after.comments->empty() ||
      before.present_alternative() != after.present_alternative())
    return;
  std::shared_ptr<Comments> comments;
  for (const auto& [id, comment] : *after.comments) {
    if (!std::binary_search(changes.removed.begin(), changes.removed.end(), comment->entity)) continue;
    const CommentPtr left = pinned_now(before, comment);
    if (left == comment) continue;
    if (!comments) comments = std::make_shared<Comments>(*after.comments);
    comments->insert_or_assign(id, left);
  }
  if (comments) after.comments = std::move(comments);
}

}  // namespace

Result<ApplyResult> apply(const Document& document, const v1::Operation& operation,
                          const ApplyContext& context) {
  auto outcome = dispatch(document, operation, context);
  if (!outcome) return outcome.error();
  ApplyResult result;
  result.document = std::move(outcome->document);
  result.changes = difference(document, result.document);
  leave_comments(document, result.changes, result.document);
  result.changes.comments = *document.comments != *result.document.comments;
  result.effective = std::move(outcome->effective);
  result.effective.set_client_id(operation.client_id());
  result.effective.set_client_op_id(operation.client_op_id());
  result.effective.set_author(operation.author());
  result.effective.set_made_ns(operation.made_ns());
  result.words = std::move(outcome->words);
  result.notes = std::move(outcome->notes);
  return result;
}

}  // namespace handloft::model
