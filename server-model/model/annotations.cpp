#include "server-model/model/annotations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "server-model/model/cad_model.h"
#include "server-model/model/dual_shape.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/model/vector_message.h"

namespace handloft::model {

namespace v1 = handloft::v1;
using geometry::Vec3;

namespace {

void extend(Eigen::AlignedBox3d& box, const ReferenceMesh& mesh) {
  for (const auto& position : mesh.positions) box.extend(Vec3(position[0], position[1], position[2]));
}

/// The first of its thread. An answer's comment is always there, and older (dangling() in step_delta.cpp).
const Comment& thread_of(const Comments& comments, const Comment& comment) {
  const Comment* first = &comment;
  for (std::size_t i = 0; i < comments.size() && !first->reply_to.empty(); ++i) {
    const auto before = comments.find(first->reply_to);
    if (before == comments.end()) break;
    first = before->second.get();
  }
  return *first;
}

}  // namespace

Vec3 place_now(const Document& document, const Comment& comment) {
  const Comment& pinned = thread_of(*document.comments, comment);
  const EntityPtr entity = document.find(pinned.entity);
  if (!entity || same_motion(entity->motion, pinned.motion)) return pinned.place;
  const Similarity now = entity->motion ? *entity->motion : Similarity();
  const Similarity since = pinned.motion ? now.after(pinned.motion->inverse()) : now;
  const Vec3 place = since(pinned.place);
  return place.allFinite() ? place : pinned.place;
}

CommentPtr pinned_now(const Document& document, const CommentPtr& comment) {
  const EntityPtr entity = document.find(comment->entity);
  if (!entity || same_motion(entity->motion, comment->motion)) return comment;
  auto pinned = std::make_shared<Comment>(*comment);
  pinned->place = place_now(document, *comment);
  pinned->motion = entity->motion;
  return pinned;
}

Vec3 centre_of(const EntityPtr& entity) {
  Eigen::AlignedBox3d box;
  Vec3 origin = Vec3::Zero();
  if (const DualPtr shape = as_dual(entity)) {
    for (const DualPoint& point : shape->points) box.extend(point.position());
    if (shape->fit) origin = shape->fit->frame.origin;
  } else if (const SculptPtr surface = as_sculpt(entity)) {
    for (const Vec3& point : surface->surface->control) box.extend(point);
  } else if (const ReferencePtr reference = as_reference(entity)) {
    extend(box, *reference->mesh);
  } else if (const CadModelPtr model = as_cad_model(entity)) {
    origin = model->translation;
    if (model->rest) extend(box, *model->rest);
  }
  return box.isEmpty() ? origin : Vec3(box.center());
}

void write_comments(const Document& document, Resolved resolved,
                    google::protobuf::RepeatedPtrField<v1::Comment>& to) {
  using Key = std::pair<std::uint64_t, std::string>;
  std::map<Key, std::vector<std::pair<Key, CommentPtr>>> threads;
  for (const auto& [id, comment] : *document.comments) {
    const Comment& first = thread_of(*document.comments, *comment);
    if (first.resolved && resolved == Resolved::left_out) continue;
    threads[{first.number, first.id}].push_back({{comment->number, id}, comment});
  }
  for (auto& [first, comments] : threads) {
    std::sort(comments.begin(), comments.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [key, comment] : comments) {
      v1::Comment& out = *to.Add();
      out.set_id(comment->id);
      out.set_text(comment->text);
      if (document.find(comment->entity)) out.set_entity(comment->entity);
      write_vector(place_now(document, *comment), *out.mutable_place());
      out.set_reply_to(comment->reply_to);
      out.set_resolved(comment->resolved);
      out.set_author(comment->author);
      out.set_made_ns(comment->made_ns);
      out.set_changed_ns(comment->changed_ns);
      out.set_client_id(comment->client_id);
    }
  }
}

void write_versions(const Document& document, google::protobuf::RepeatedPtrField<v1::Version>& to) {
  std::vector<VersionPtr> versions;
  for (const auto& [name, version] : *document.versions) versions.push_back(version);
  std::stable_sort(versions.begin(), versions.end(),
                   [](const VersionPtr& a, const VersionPtr& b) { return a->sequence < b->sequence; });
  for (const VersionPtr& version : versions) {
    v1::Version& out = *to.Add();
    out.set_name(version->name);
    out.set_note(version->note);
    out.set_author(version->author);
    out.set_made_ns(version->made_ns);
    out.set_alternative(version->alternative);
    out.set_sequence(version->sequence);
    out.set_parent(version->parent);
  }
}

}  // namespace handloft::model
