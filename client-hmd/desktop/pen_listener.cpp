#include "client-hmd/desktop/pen_listener.h"

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/extensions/XInput2.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <utility>

namespace handloft::client {
namespace {

/// What tablets' drivers call the axis.
constexpr const char* pressure_label = "Abs Pressure";

struct Axis {
  int number = 0;
  double low = 0.0;
  double high = 1.0;
};

struct CloseDisplay {
  void operator()(Display* display) const { XCloseDisplay(display); }
};

}  // namespace

struct PenListener::Implementation {
  std::unique_ptr<Display, CloseDisplay> display;
  int opcode = 0;
  std::map<int, Axis> pens;  ///< By device.

  void find_pens() {
    pens.clear();
    const Atom pressure = XInternAtom(display.get(), pressure_label, True);
    if (pressure == None) return;
    int count = 0;
    XIDeviceInfo* devices = XIQueryDevice(display.get(), XIAllDevices, &count);
    if (devices == nullptr) return;
    for (int i = 0; i < count; ++i) {
      if (devices[i].use != XISlavePointer && devices[i].use != XIFloatingSlave) continue;
      for (int k = 0; k < devices[i].num_classes; ++k) {
        if (devices[i].classes[k]->type != XIValuatorClass) continue;
        const auto* valuator = reinterpret_cast<const XIValuatorClassInfo*>(devices[i].classes[k]);
        if (valuator->label != pressure || !(valuator->max > valuator->min)) continue;
        pens[devices[i].deviceid] = {valuator->number, valuator->min, valuator->max};
      }
    }
    XIFreeDeviceInfo(devices);
  }

  void listen() {
    std::array<unsigned char, XIMaskLen(XI_LASTEVENT)> bits{};
    XISetMask(bits.data(), XI_RawMotion);
    XISetMask(bits.data(), XI_RawButtonPress);
    XISetMask(bits.data(), XI_HierarchyChanged);
    XIEventMask mask{XIAllDevices, static_cast<int>(bits.size()), bits.data()};
    XISelectEvents(display.get(), DefaultRootWindow(display.get()), &mask, 1);
    XFlush(display.get());
  }

  std::optional<double> pressure_of(const XIRawEvent& event) const {
    const auto pen = pens.find(event.sourceid);
    if (pen == pens.end()) return std::nullopt;
    const Axis& axis = pen->second;
    int index = 0;
    for (int i = 0; i < event.valuators.mask_len * 8; ++i) {
      if (!XIMaskIsSet(event.valuators.mask, i)) continue;
      if (i == axis.number) {
        return std::clamp((event.raw_values[index] - axis.low) / (axis.high - axis.low), 0.0, 1.0);
      }
      ++index;
    }
    return std::nullopt;
  }
};

PenListener::PenListener(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

PenListener::~PenListener() = default;

std::unique_ptr<PenListener> PenListener::open() {
  if (std::getenv("DISPLAY") == nullptr) return nullptr;
  auto parts = std::make_unique<Implementation>();
  parts->display.reset(XOpenDisplay(nullptr));
  if (parts->display == nullptr) return nullptr;
  int event = 0, error = 0, major = 2, minor = 0;
  if (XQueryExtension(parts->display.get(), "XInputExtension", &parts->opcode, &event, &error) == False ||
      XIQueryVersion(parts->display.get(), &major, &minor) != Success) {
    return nullptr;
  }
  parts->listen();
  parts->find_pens();
  return std::unique_ptr<PenListener>(new PenListener(std::move(parts)));
}

std::optional<double> PenListener::poll() {
  Implementation& self = *implementation_;
  std::optional<double> newest;
  while (XPending(self.display.get()) > 0) {
    XEvent event;
    XNextEvent(self.display.get(), &event);
    XGenericEventCookie& cookie = event.xcookie;
    if (cookie.type != GenericEvent || cookie.extension != self.opcode ||
        XGetEventData(self.display.get(), &cookie) == False) {
      continue;
    }
    if (cookie.evtype == XI_HierarchyChanged) {
      self.find_pens();
      newest = 0.0;  // Whatever pressed may be gone.
    } else if (const auto pressure = self.pressure_of(*static_cast<const XIRawEvent*>(cookie.data))) {
      newest = pressure;
    }
    XFreeEventData(self.display.get(), &cookie);
  }
  return newest;
}

}  // namespace handloft::client
