// Any Join of clients that say they have been here before (F1, U3): each is refused, or told once that it has
// joined and sent a scene that names no entity which there is not, by an amount that the model bounds, not
// the client. The input is a sequence of messages, each a byte, a two-byte little-endian length and a Join.
// An even byte: its epoch becomes the right one, which nobody could guess.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "server-model/session/peers.h"
#include "tests/support/fake_connection.h"

namespace {

using namespace handloft;

void require(bool good) {
  if (!good) std::abort();
}

model::Model two_shapes() {
  model::Model model;
  for (const char* id : {"a", "b"}) {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity(id);
    operation.mutable_add_points()->mutable_create()->set_degree(2);
    for (int i = 0; i < 12; ++i) {
      auto& point = *operation.mutable_add_points()->add_points();
      point.mutable_position()->set_x(0.01 * (i % 4));
      point.mutable_position()->set_y(0.01 * (i / 4));
      point.set_pressure(0.5);
    }
    require(model.submit(operation).ok());
    operation.mutable_fit()->set_entity(id);
    require(model.submit(operation).ok());
  }
  v1::Operation operation;
  operation.mutable_add_comment()->set_text("higher");
  operation.mutable_add_comment()->set_entity("a");
  require(model.submit(operation).ok());
  operation.mutable_name_version()->set_name("first");
  require(model.submit(operation).ok());
  return model;
}

std::shared_ptr<test::FakeConnection> connect(const net::ServerEvents& events, std::uint64_t id) {
  net::PeerInfo info;
  info.role = v1::ROLE_EDITOR;
  info.name = "peer";
  info.protocol_minor = net::protocol_minor;
  auto connection = std::make_shared<test::FakeConnection>(id, info);
  require(events.on_join(connection).ok());
  return connection;
}

bool is_there(const std::string& id) {
  return id == "a" || id == "b";
}

/// What is told once, and bounded. The epoch of the scene; 0: it was not let in.
std::uint64_t check(const test::FakeConnection& connection) {
  std::uint64_t epoch = 0;
  std::size_t joined = 0, snapshots = 0, entities = 0;
  bool resumed = false;
  for (const v1::Envelope& envelope : connection.sent()) {
    if (envelope.has_joined()) {
      ++joined;
      epoch = envelope.joined().epoch();
      resumed = envelope.joined().resumed();
    }
    snapshots += envelope.has_snapshot() ? 1 : 0;
    const auto& sent = envelope.has_snapshot() ? envelope.snapshot().entities() : envelope.delta().changed();
    for (const v1::EntityState& entity : sent) require(is_there(entity.id()));
    entities += static_cast<std::size_t>(sent.size());
    for (const std::string& id : envelope.delta().removed()) require(!is_there(id));
  }
  constexpr std::size_t most = 8;  // Two entities, each in several messages.
  require(joined <= 1 && snapshots <= 1 && entities <= most);
  require(!resumed || snapshots == 0);
  return epoch;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ManualClock clock(from_ns(1'000'000'000'000));
  session::ServerOptions options;
  options.actor.export_folder = "/nonexistent";
  const auto peers = session::Peers::start(two_shapes(), options, clock, Logger("fuzz", LogLevel::off));
  const net::ServerEvents events = peers->events(net::Endpoint::Kind::tcp);
  std::uint64_t id = 1;
  const auto first = connect(events, id);
  v1::Envelope join;
  join.mutable_join();
  require(events.on_message(first, join).ok());
  (void)peers->actor().state();
  const std::uint64_t epoch = check(*first);
  constexpr std::size_t head = 3;
  constexpr int most_joins = 8;
  for (int i = 0; size >= head && i < most_joins; ++i) {
    const std::size_t length = std::min<std::size_t>(data[1] + std::size_t{256} * data[2], size - head);
    const bool parsed = join.mutable_join()->ParseFromArray(data + head, static_cast<int>(length));
    if (data[0] % 2 == 0) join.mutable_join()->set_epoch(epoch);
    data += head + length;
    size -= head + length;
    if (!parsed) continue;
    clock.advance(std::chrono::milliseconds(10));
    const auto connection = connect(events, ++id);
    const bool in = events.on_message(connection, join).ok();
    (void)peers->actor().state();
    const std::uint64_t told = check(*connection);
    require(in || told == 0);
    require(told == 0 || told == epoch);
    events.on_closed(connection, "the end");
  }
  events.on_closed(first, "the end");
  (void)peers->actor().state();
  require(peers->peer_count() == 0);
  peers->actor().stop();
  return 0;
}
