#include "client-hmd/main/panel_operations.h"

namespace handloft::client {
namespace {

v1::Representation wire_representation(Representation representation) {
  switch (representation) {
    case Representation::points:
      return v1::REPRESENTATION_POINTS;
    case Representation::surface:
      return v1::REPRESENTATION_SURFACE;
    case Representation::both:
      return v1::REPRESENTATION_BOTH;
  }
  return v1::REPRESENTATION_UNSPECIFIED;
}

/// One function a kind of request; true: it is an operation.
struct Writer {
  v1::Operation& operation;

  bool operator()(const RenameShape& request) const {
    operation.mutable_rename()->set_entity(request.id);
    operation.mutable_rename()->set_name(request.name);
    return true;
  }
  bool operator()(const DeleteShape& request) const {
    operation.mutable_delete_()->set_entity(request.id);
    return true;
  }
  bool operator()(const ShowShape& request) const {
    operation.mutable_set_representation()->set_entity(request.id);
    operation.mutable_set_representation()->set_representation(wire_representation(request.representation));
    return true;
  }
  bool operator()(const SwitchAlternative& request) const {
    operation.mutable_switch_alternative()->set_name(request.name);
    return true;
  }
  bool operator()(const CommentOn& request) const {
    operation.mutable_add_comment()->set_entity(request.entity);
    operation.mutable_add_comment()->set_text(request.text);
    // The table's middle, where there is no shape.
    if (request.entity.empty()) operation.mutable_add_comment()->mutable_place();
    return true;
  }
  bool operator()(const ReplyTo& request) const {
    operation.mutable_add_comment()->set_reply_to(request.comment);
    operation.mutable_add_comment()->set_text(request.text);
    return true;
  }
  bool operator()(const ResolveComment& request) const {
    operation.mutable_change_comment()->set_id(request.id);
    operation.mutable_change_comment()->set_resolved(request.resolved);
    return true;
  }
  bool operator()(const DeleteRemark& request) const {
    operation.mutable_delete_comment()->set_id(request.comment);
    return true;
  }
  bool operator()(const KeepVersion& request) const {
    operation.mutable_name_version()->set_name(request.name);
    return true;
  }
  bool operator()(const RestoreNamed& request) const {
    operation.mutable_restore_version()->set_name(request.version);
    return true;
  }
  bool operator()(const BranchFrom& request) const {
    operation.mutable_new_alternative()->set_version(request.version);
    return true;
  }
  bool operator()(const DeleteNamed& request) const {
    operation.mutable_delete_version()->set_name(request.version);
    return true;
  }
  bool operator()(const DesktopCommand&) const { return false; }
  bool operator()(const CompareVersions&) const { return false; }
  bool operator()(const ChangeView&) const { return false; }
  bool operator()(const ChangeSettings&) const { return false; }
};

}  // namespace

std::optional<v1::Operation> operation_of(const PanelRequest& request) {
  v1::Operation operation;
  if (!std::visit(Writer{operation}, request)) return std::nullopt;
  return operation;
}

}  // namespace handloft::client
