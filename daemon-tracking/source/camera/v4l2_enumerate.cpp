#include "daemon-tracking/source/camera/v4l2_enumerate.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "daemon-tracking/source/camera/v4l2_probe.h"
#include "daemon-tracking/source/camera/v4l2_words.h"

namespace handloft::tracking {

namespace {

// A device's port and serial number, without the node that changes with every plug.
bool same_device(const V4l2Node& a, const V4l2Node& b) {
  return a.path == b.path && a.serial == b.serial && a.usb_id == b.usb_id;
}

bool same_place(const std::string& wanted, const std::string& path) {
  return wanted.empty() || wanted == path;
}

std::string list_words(const std::vector<V4l2Node>& nodes) {
  if (nodes.empty()) return "no camera";
  std::string words;
  std::vector<V4l2Node> named;
  for (const V4l2Node& node : nodes) {
    // A camera and its metadata node are one device.
    const auto known = [&](const V4l2Node& other) {
      return same_device(node, other) && node.name == other.name;
    };
    if (std::any_of(named.begin(), named.end(), known)) continue;
    named.push_back(node);
    words += fmt::format("{}{} ({})", words.empty() ? "" : "; ", identity_of(node), node.node);
  }
  return words;
}

// A driver may name a node otherwise than the camera names itself.
bool is_model(const V4l2Node& node, const std::string& model) {
  return model.empty() || node.product == model || node.name.starts_with(model);
}

std::vector<V4l2Node> fitting(const std::vector<V4l2Node>& nodes, const CameraSelector& selector) {
  std::vector<V4l2Node> found;
  for (const V4l2Node& node : nodes) {
    if (same_place(selector.path, node.path) && (selector.serial.empty() || selector.serial == node.serial) &&
        (selector.usb_id.empty() || selector.usb_id == node.usb_id) && is_model(node, selector.model) &&
        (selector.node.empty() || selector.node == node.node)) {
      found.push_back(node);
    }
  }
  return found;
}

Result<NodeMatch> only_one(std::vector<V4l2Node> found, const CameraSelector& selector, std::string note) {
  for (const V4l2Node& node : found) {
    if (!same_device(node, found.front())) {
      return make_error(
          ErrorCode::failed_precondition,
          fmt::format("more than one camera fits '{}': {}; name the path of the one that is meant",
                      to_string(selector), list_words(found)),
          "camera");
    }
  }
  return NodeMatch{std::move(found), std::move(note)};
}

// "/dev/v4l/by-path/pci-...-video-index0" as it stands for the node it links to.
std::string resolved(const std::string& node) {
  std::error_code ignored;
  const std::filesystem::path target = std::filesystem::canonical(node, ignored);
  return ignored ? node : target.string();
}

}  // namespace

std::string identity_of(const V4l2Node& node) {
  std::string words = node.usb_id;
  const auto add = [&](const std::string& part) {
    if (!words.empty()) words += ' ';
    words += part;
  };
  if (!node.serial.empty()) add("serial " + node.serial);
  if (!node.path.empty()) add("at " + node.path);
  return words.empty() ? node.name : words;
}

std::vector<V4l2CameraInfo> list_v4l2_cameras(V4l2System& system) {
  std::vector<V4l2CameraInfo> cameras;
  for (V4l2Node& node : system.nodes()) {
    V4l2CameraInfo info;
    info.identity = identity_of(node);
    info.model = node.name;
    const int fd = system.open(node.node);
    if (fd < 0) {
      if (is_gone(-fd)) continue;  // Unplugged while we looked.
      info.unusable = camera_error(CameraStep::open, -fd, node.node).message;
      info.node = std::move(node);
      cameras.push_back(std::move(info));
      continue;
    }
    const Result<NodeCapability> capability = query_capability(system, fd, node.node);
    const NodeKind kind = capability ? capability->kind : NodeKind::other;
    if (kind == NodeKind::capture) info.sizes = query_sizes(system, fd);
    system.close(fd);
    if (kind == NodeKind::other) continue;
    info.model = capability->card;
    info.driver = capability->driver;
    info.bus_info = capability->bus_info;
    if (kind == NodeKind::multi_planar) {
      info.unusable = "it has the multi-planar interface, which the daemon does not read";
    } else if (kind == NodeKind::not_streaming) {
      info.unusable = "it gives pictures by read() only, the daemon needs streaming";
    } else if (info.sizes.empty()) {
      info.unusable = "it has none of the formats MJPEG, YUYV and GREY";
    }
    info.node = std::move(node);
    cameras.push_back(std::move(info));
  }
  return cameras;
}

std::vector<V4l2CameraInfo> list_v4l2_cameras() {
  return list_v4l2_cameras(*make_v4l2_system());
}

Result<CameraSelector> parse_camera_selector(std::string_view text) {
  CameraSelector selector;
  if (text.starts_with("/")) {
    selector.node = std::string(text);
    return selector;
  }
  while (!text.empty()) {
    const std::string_view part = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), part.size() + 1));
    const std::size_t equals = part.find('=');
    const std::string_view key = part.substr(0, equals);
    const std::string value(equals == std::string_view::npos ? std::string_view() : part.substr(equals + 1));
    std::string* field = key == "path"     ? &selector.path
                         : key == "serial" ? &selector.serial
                         : key == "usb"    ? &selector.usb_id
                         : key == "model"  ? &selector.model
                         : key == "node"   ? &selector.node
                                           : nullptr;
    if (field == nullptr || value.empty()) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found '{}', expected path=, serial=, usb=, model= or node= with a value, "
                      "joined by commas, or a /dev/videoN",
                      part),
          "camera");
    }
    *field = value;
  }
  if (to_string(selector).empty()) {
    return make_error(ErrorCode::invalid_argument, "found nothing, expected which camera is meant", "camera");
  }
  return selector;
}

std::string to_string(const CameraSelector& selector) {
  std::string words;
  const auto add = [&](const char* key, const std::string& value) {
    if (!value.empty()) words += fmt::format("{}{}={}", words.empty() ? "" : ",", key, value);
  };
  add("path", selector.path);
  add("serial", selector.serial);
  add("usb", selector.usb_id);
  add("model", selector.model);
  add("node", selector.node);
  return words;
}

Result<NodeMatch> match_camera(const std::vector<V4l2Node>& nodes, const CameraSelector& selector,
                               IdentityMismatch mismatch) {
  CameraSelector wanted = selector;
  if (!wanted.node.empty()) wanted.node = resolved(wanted.node);
  std::vector<V4l2Node> found = fitting(nodes, wanted);
  if (!found.empty()) return only_one(std::move(found), selector, {});
  if (!wanted.path.empty() && !wanted.serial.empty()) {
    CameraSelector elsewhere = wanted;
    elsewhere.path.clear();
    std::vector<V4l2Node> moved = fitting(nodes, elsewhere);
    if (!moved.empty()) {
      const std::string note = fmt::format("the camera with serial {} moved from {} to {}", wanted.serial,
                                           wanted.path, moved.front().path);
      if (mismatch == IdentityMismatch::refuse) {
        return make_error(ErrorCode::failed_precondition,
                          note + "; plug it back, or confirm by changing the camera's path", "camera");
      }
      return only_one(std::move(moved), selector, note + "; check that it still looks where it did");
    }
    CameraSelector in_place = wanted;
    in_place.serial.clear();
    const std::vector<V4l2Node> other = fitting(nodes, in_place);
    if (!other.empty()) {
      return make_error(
          ErrorCode::failed_precondition,
          fmt::format("another camera is plugged in where serial {} was: {}; calibrate it and change "
                      "the camera's serial, or plug the old one back",
                      wanted.serial, identity_of(other.front())),
          "camera");
    }
  }
  return make_error(ErrorCode::not_found,
                    fmt::format("found {}, expected '{}'", list_words(nodes), to_string(selector)), "camera");
}

}  // namespace handloft::tracking
