#pragma once
// What a hostile, broken or foreign server may do to a viewer, one attack each (V5, F1 and F2 of
// reliability.md).

#include <string>
#include <vector>

#include "tests/support/hostile_server.h"

namespace handloft::client::test {

enum class Outcome {
  ignored,   ///< Read, and nothing comes of it.
  refused,   ///< The message is refused, the connection stays.
  hangs_up,  ///< Bytes that cannot be trusted any more: the client hangs up and comes again.
};

struct Attack {
  const char* name;
  Outcome outcome;
  /// Sends it to a client that was greeted and has the good scene. False: the client hung up meanwhile.
  bool (*run)(handloft::test::HostileConnection&);
};

/// Of one that greets well.
const std::vector<Attack>& attacks();

struct BadGreeting {
  const char* name;
  /// In place of a Welcome; the client is expected to hang up, and the connection is closed afterwards.
  void (*run)(handloft::test::HostileConnection&);
};
const std::vector<BadGreeting>& bad_greetings();

/// The scene that was there before, and must still be there afterwards: "top" of scene_messages.h. False: the
/// client hung up.
bool send_good_scene(handloft::test::HostileConnection& client);
inline constexpr std::size_t good_points = 3;
/// Greets, is joined, and sends it.
bool serve_good_scene(handloft::test::HostileConnection& client);

}  // namespace handloft::client::test
