// The modification disk pushes points (A13-A17); push_gesture.h says how.

#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/push_gesture.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<Outcome> push_points(const Document& document, const handloft::v1::PushPoints& request,
                            const ApplyContext& context) {
  const auto in_request = [](Error error) {
    error.field = "push_points." + error.field;
    return error;
  };
  const auto poses = static_cast<std::size_t>(request.path_size());
  if (auto status = check_push(request.range(), poses, context.limits); !status) {
    return in_request(status.error());
  }
  if (poses < 2) {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected at least 2 poses", poses),
                      "push_points.path");
  }
  if (request.falloff() != handloft::v1::FALLOFF_LITERAL &&
      request.falloff() != handloft::v1::FALLOFF_SMOOTH) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected FALLOFF_LITERAL or FALLOFF_SMOOTH",
                                  static_cast<int>(request.falloff())),
                      "push_points.falloff");
  }
  auto gesture = PushGesture::begin(document, request);
  if (!gesture) return in_request(gesture.error());
  for (int i = 0; i < request.path_size(); ++i) {
    auto pose = read_disk_pose(request.path(i), fmt::format("path[{}]", i), context.limits);
    if (!pose) return in_request(pose.error());
    if (auto status = gesture->move_disk(*pose); !status) return in_request(status.error());
  }
  Outcome outcome;
  auto pushed = gesture->result(document, request, context, outcome.notes);
  if (!pushed) return in_request(pushed.error());
  outcome.document = std::move(pushed->document);
  *outcome.effective.mutable_push_points() = request;
  const DualPtr first = document.find_dual(request.entities(0));
  outcome.words = fmt::format("Push {} point{} of \"{}\"", pushed->contacts, pushed->contacts == 1 ? "" : "s",
                              first->name);
  if (request.entities_size() > 1) outcome.words += fmt::format(" and {} more", request.entities_size() - 1);
  return outcome;
}

}  // namespace handloft::model
