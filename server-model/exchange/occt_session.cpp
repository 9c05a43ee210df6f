#include "server-model/exchange/occt_session.h"

#include <fmt/format.h>

#include <IGESControl_Controller.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Controller.hxx>
#include <Standard_Failure.hxx>
#include <exception>
#include <new>

namespace handloft::exchange::detail {
namespace {

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

OcctSession::OcctSession() : lock_(library_mutex()) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  STEPControl_Controller::Init();  // Register the settings; later calls do nothing.
  IGESControl_Controller::Init();
}

Status guarded(const char* doing, const std::function<Status()>& work) {
  try {
    return work();
  } catch (const Standard_Failure& failure) {
    const char* text = failure.GetMessageString();
    return make_error(ErrorCode::internal,
                      fmt::format("{} failed in the CAD kernel: {}", doing,
                                  text != nullptr && *text != '\0' ? text : "no reason given"));
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::resource_exhausted, fmt::format("{} ran out of memory", doing));
  } catch (const std::exception& exception) {
    return make_error(ErrorCode::internal, fmt::format("{} failed: {}", doing, exception.what()));
  }
}

}  // namespace handloft::exchange::detail

#if defined(__SANITIZE_ADDRESS__)
#define HANDLOFT_LEAKS_ARE_LOOKED_FOR
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define HANDLOFT_LEAKS_ARE_LOOKED_FOR
#endif
#endif
#ifdef HANDLOFT_LEAKS_ARE_LOOKED_FOR
/// The library keeps its registries and some translation objects until the process ends; not ours to free.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libTKernel\nleak:libTKXSBase\nleak:libTKSTEP\nleak:libTKIGES\n";
}
#endif
