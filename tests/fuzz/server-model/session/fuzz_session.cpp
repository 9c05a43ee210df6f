// Any envelopes from three peers (two editors and a viewer), as a server handles them, without sockets: never
// a crash, never NaN in the model, a viewer changes nothing, and nothing of a peer is left when it is gone
// (X5, U2). The input is a sequence of messages, each a byte that says whose it is, a two-byte little-endian
// length and an Envelope.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "server-model/model/canonical.h"
#include "server-model/session/peers.h"
#include "tests/support/fake_connection.h"

namespace {

using namespace handloft;

void require(bool good) {
  if (!good) std::abort();
}

void require_finite(const model::Document& document) {
  for (const auto& [id, entity] : document.entities) {
    const model::DualPtr shape = model::as_dual(entity);
    if (!shape) continue;
    for (const auto& point : shape->points)
      require(point.position().allFinite() && std::isfinite(point.pressure));
    if (!shape->fit) continue;
    for (const double coefficient : shape->fit->surface.coefficients()) require(std::isfinite(coefficient));
  }
}

std::shared_ptr<test::FakeConnection> connect(const net::ServerEvents& events, std::uint64_t id,
                                              v1::Role role) {
  net::PeerInfo info;
  info.role = role;
  info.name = "peer";
  info.protocol_minor = net::protocol_minor;
  auto connection = std::make_shared<test::FakeConnection>(id, info);
  require(events.on_join(connection).ok());
  return connection;
}

/// Files are another subject, and would be written.
bool names_files(const v1::Envelope& envelope) {
  const v1::Operation& operation = envelope.submit().operation();
  return operation.has_export_() || operation.has_import_model() || operation.has_import_reference() ||
         operation.has_import_strokes() || envelope.hand_command().command() == "export_file";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ManualClock clock(from_ns(1'000'000'000'000));
  session::ServerOptions options;
  options.actor.export_folder = "/nonexistent";
  const auto peers = session::Peers::start(model::Model(), options, clock, Logger("fuzz", LogLevel::off));
  const net::ServerEvents events = peers->events(net::Endpoint::Kind::tcp);
  constexpr std::size_t viewer = 2;
  std::array<std::shared_ptr<test::FakeConnection>, 3> connections;
  for (std::size_t i = 0; i < connections.size(); ++i) {
    connections[i] = connect(events, i + 1, i == viewer ? v1::ROLE_VIEWER : v1::ROLE_EDITOR);
    v1::Envelope join;
    join.mutable_join();
    require(events.on_message(connections[i], join).ok());
  }
  constexpr std::size_t head = 3;
  while (size >= head) {
    const std::size_t whose = data[0] % connections.size();
    const std::size_t length = std::min<std::size_t>(data[1] + std::size_t{256} * data[2], size - head);
    v1::Envelope envelope;
    const bool parsed = envelope.ParseFromArray(data + head, static_cast<int>(length));
    data += head + length;
    size -= head + length;
    if (!parsed || names_files(envelope)) continue;
    clock.advance(std::chrono::milliseconds(10));
    const std::string before = whose == viewer ? peers->actor().state().hash : std::string();
    static_cast<void>(events.on_message(connections[whose], envelope));
    if (whose == viewer) require(peers->actor().state().hash == before);
  }
  require_finite(peers->actor().state().document);
  for (const auto& connection : connections) events.on_closed(connection, "the end");
  const session::ActorState state = peers->actor().state();
  require_finite(state.document);
  require(peers->peer_count() == 0);
  for (const auto& [id, entity] : peers->actor().scene()->entities) require(!entity.provisional);
  peers->actor().stop();
  return 0;
}
