#include "tests/integration/client-hmd/hostile_attacks.h"

#include <limits>
#include <random>

#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client::test {
namespace {

using handloft::test::HostileConnection;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr std::uint32_t four_milliards = 4'000'000'000U;
constexpr int a_million = 1'000'000;

v1::Envelope a_delta() {
  v1::Envelope envelope;
  *envelope.mutable_delta() = delta();
  return envelope;
}

/// A delta of "top" as `spoil` leaves it.
bool spoiled(HostileConnection& client, void (*spoil)(v1::EntityState&)) {
  v1::Envelope envelope = a_delta();
  spoil(*envelope.mutable_delta()->mutable_changed(0));
  return client.send(envelope);
}

std::string noise(std::size_t bytes) {
  std::mt19937 random(20261122);
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>(random() & 0xFFU);
  return text;
}

v1::EntityState entity(const std::string& id) {
  v1::EntityState state;
  state.set_id(id);
  state.set_revision(1);
  state.set_representation(v1::REPRESENTATION_BOTH);
  return state;
}

v1::Mesh numbered(std::uint64_t topology) {
  v1::Mesh mesh = triangle();
  mesh.set_topology(topology);
  return mesh;
}

/// Clouds of a million points until a viewer's eight are full; the last is the one too many.
bool points_without_end(HostileConnection& client) {
  v1::PointCloud million = cloud(0, 1);
  million.set_total(a_million);
  million.set_positions(std::string(std::size_t{12} * a_million, '\0'));
  million.set_styles(std::string(std::size_t{2} * a_million, '\0'));
  for (int i = 0; i < 9; ++i) {
    v1::Envelope envelope = a_delta();
    v1::EntityState& state = *envelope.mutable_delta()->mutable_changed(0);
    state = entity("cloud " + std::to_string(i));
    *state.mutable_points() = million;
    if (!client.send(envelope)) return false;
  }
  return true;
}

bool endless_snapshots(HostileConnection& client) {
  v1::Envelope envelope;
  for (int i = 0; i < 500; ++i) {
    *envelope.mutable_snapshot() = snapshot();
    envelope.mutable_snapshot()->set_sequence(static_cast<std::uint64_t>(i));
    if (!client.send(envelope)) return false;
  }
  return true;
}

/// Each epoch is fine by itself; deltas of the one before are not.
bool epochs_in_a_circle(HostileConnection& client) {
  v1::Envelope whole;
  for (const std::uint64_t epoch : {8U, 7U, 9U, 7U}) {
    *whole.mutable_snapshot() = snapshot();
    whole.mutable_snapshot()->set_epoch(epoch);
    v1::Envelope stale = a_delta();
    stale.mutable_delta()->set_epoch(epoch + 1);
    if (!client.send(whole) || !client.send(stale)) return false;
  }
  return true;
}

bool topology_with_other_counts(HostileConnection& client) {
  v1::Envelope known = a_delta();
  *known.mutable_delta()->mutable_changed(0)->mutable_surface() = numbered(5);
  v1::Envelope other = a_delta();
  v1::Mesh& mesh = *other.mutable_delta()->mutable_changed(0)->mutable_surface();
  mesh = numbered(5);
  mesh.clear_indices();
  mesh.set_index_count(300);
  return client.send(known) && client.send(other);
}

/// The same number, as many indices, fewer vertices: a viewer that trusted the number would draw beyond them.
bool topology_with_other_triangles(HostileConnection& client) {
  codec::MeshData large;
  for (int i = 0; i < 300; ++i) {
    large.positions.push_back({0.001F * static_cast<float>(i), 0, 0.02F});
    large.normals.push_back({0, 0, 1});
    large.opacity.push_back(255);
    large.indices.push_back(static_cast<std::uint32_t>(i));
  }
  v1::Envelope first = a_delta();
  v1::Mesh& mesh = *first.mutable_delta()->mutable_changed(0)->mutable_surface();
  mesh = *codec::encode_mesh(large);
  mesh.set_topology(5);
  codec::MeshData small;
  small.positions.assign(large.positions.begin(), large.positions.begin() + 3);
  small.normals.assign(3, {0, 0, 1});
  small.opacity.assign(3, 255);
  for (std::uint32_t i = 0; i < 300; ++i) small.indices.push_back(i % 3);
  v1::Envelope second = a_delta();
  v1::Mesh& fewer = *second.mutable_delta()->mutable_changed(0)->mutable_surface();
  fewer = *codec::encode_mesh(small);
  fewer.set_topology(5);
  return client.send(first) && client.send(second) && client.send(first) && send_good_scene(client);
}

bool presence_of_everybody(HostileConnection& client) {
  v1::Envelope envelope;
  v1::Presence& presence = *envelope.mutable_presence();
  for (std::uint64_t i = 0; i < 3000; ++i) {
    presence.Clear();
    presence.set_client_id(i + 2);
    presence.set_name(std::string(1000, 'n'));
    presence.set_capture_time_ns(i % 2 == 0 ? std::numeric_limits<std::int64_t>::max()
                                            : std::numeric_limits<std::int64_t>::min());
    presence.mutable_disk()->mutable_centre()->set_x(i % 3 == 0 ? nan : 1e300);
    if (i % 5 == 0) presence.clear_disk();
    if (!client.send(envelope)) return false;
  }
  return true;
}

bool failures_of_megabytes(HostileConnection& client) {
  v1::Envelope envelope;
  envelope.mutable_failure()->set_code("\x1B[2J\x1B[31m");
  envelope.mutable_failure()->set_message(std::string(a_million, '\x1B'));
  for (int i = 0; i < 10; ++i) {
    if (!client.send(envelope)) return false;
  }
  return true;
}

}  // namespace

bool send_good_scene(HostileConnection& client) {
  v1::Envelope envelope;
  *envelope.mutable_snapshot() = snapshot(good_points);
  return client.send(envelope);
}

bool serve_good_scene(HostileConnection& client) {
  return client.greet() && client.wait_for_join() && send_good_scene(client) && client.survives();
}

const std::vector<Attack>& attacks() {
  using enum Outcome;
  static const std::vector<Attack> all{
      // ---- bytes that are no protocol ----
      {"Noise", hangs_up, [](HostileConnection& c) { return c.send_bytes(noise(65'536)); }},
      {"AFrameOfFourGigabytes", hangs_up,
       [](HostileConnection& c) { return c.send_bytes(std::string("\xFF\xFF\xFF\xFF\x01", 5)); }},
      {"AnotherProtocol", hangs_up,
       [](HostileConnection& c) { return c.send_bytes("HTTP/1.1 400 Bad Request\r\n\r\n"); }},
      {"AFrameThatIsNoMessage", hangs_up,
       [](HostileConnection& c) { return c.send_bytes(std::string("\x04\0\0\0\xFF\xFF\xFF\xFF", 8)); }},
      {"MessagesNestedWithoutEnd", hangs_up,
       [](HostileConnection& c) {
         std::string groups;
         for (int i = 0; i < 10'000; ++i) groups += "\xAB\x01";  // Field 21, begin of a group.
         std::string header(4, '\0');
         header[0] = static_cast<char>(groups.size() & 0xFFU);
         header[1] = static_cast<char>(groups.size() >> 8U & 0xFFU);
         return c.send_bytes(header + groups);
       }},
      // ---- bombs: little on the wire, much in memory ----
      {"AMillionEmptyEntities", hangs_up,
       [](HostileConnection& c) {
         v1::Envelope envelope;
         for (int i = 0; i < a_million; ++i) envelope.mutable_snapshot()->add_entities();
         return c.send(envelope);
       }},
      {"AMillionEmptyIcons", hangs_up,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           for (int i = 0; i < a_million; ++i) s.add_icons();
         });
       }},
      {"AMillionNamesRemoved", hangs_up,
       [](HostileConnection& c) {
         v1::Envelope envelope = a_delta();
         for (int i = 0; i < a_million; ++i) envelope.mutable_delta()->add_removed();
         return c.send(envelope);
       }},
      {"AHundredThousandEntities", refused,
       [](HostileConnection& c) {
         v1::Envelope envelope = a_delta();
         for (int i = 0; i < 100'000; ++i)
           *envelope.mutable_delta()->add_changed() = entity("e" + std::to_string(i));
         return c.send(envelope);
       }},
      {"FiveThousandIcons", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           s.set_icons_shown(true);
           for (int i = 0; i < 5000; ++i) s.add_icons()->set_id("i");
         });
       }},
      {"AHundredThousandEmptyCurves", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           s.set_curves_shown(true);
           for (int i = 0; i < 100'000; ++i) s.add_curves();
         });
       }},
      {"FourMilliardVertices", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) { s.mutable_surface()->set_vertex_count(four_milliards); });
       }},
      {"AMillionVerticesOfNoBytes", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           v1::Mesh& mesh = *s.mutable_surface();
           mesh = triangle();
           mesh.set_vertex_count(a_million);
           mesh.set_opacity(std::string(a_million, '\xFF'));
         });
       }},
      {"FourMilliardIndices", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_surface() = triangle();
           s.mutable_surface()->set_index_count(3'999'999'999U);
         });
       }},
      {"SixMillionIndicesOfNoBytes", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_surface() = triangle();
           s.mutable_surface()->set_index_count(6'000'000);
           s.mutable_surface()->set_indices(std::string(2'000'001, '\xE1'));
         });
       }},
      {"FourMilliardPoints", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) { s.mutable_points()->set_total(four_milliards); });
       }},
      {"PointsWithoutEndOverManyMessages", refused, points_without_end},
      {"ANameOfEightMegabytes", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) { s.set_name(std::string(8U << 20U, 'n')); });
       }},
      {"OneEntityFourThousandTimes", refused,
       [](HostileConnection& c) {
         v1::Envelope envelope = a_delta();
         v1::EntityState& first = *envelope.mutable_delta()->mutable_changed(0);
         *first.mutable_points() = cloud(3, 0);
         for (int i = 0; i < 4000; ++i) *envelope.mutable_delta()->add_changed() = first;
         return c.send(envelope);
       }},
      // ---- numbers that are none ----
      {"PointsOfNan", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_points() = cloud(3, 2);
           s.mutable_points()->mutable_origin()->set_y(nan);
         });
       }},
      {"AnInfiniteStep", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_surface() = triangle();
           s.mutable_surface()->set_step_m(infinite);
         });
       }},
      {"CurvesOfNan", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           s.set_curves_shown(true);
           s.add_curves()->set_points(packed({0, nan_f, 0}));
         });
       }},
      {"AStyleOfNan", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_points() = cloud(3, 2);
           s.mutable_points()->mutable_palette(0)->set_radius_m(nan_f);
         });
       }},
      {"DistancesOfNan", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_surface() = triangle();
           s.set_distances(packed({nan_f, 0, 0}));
         });
       }},
      {"AResidualOfNan", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) { s.set_residual_rms_m(nan); });
       }},
      // ---- indices and order ----
      {"IndicesOutOfRange", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_surface() = triangle();
           codec::MeshData mesh;
           mesh.positions.assign(9, {0, 0, 0});
           mesh.normals.assign(9, {0, 0, 1});
           mesh.opacity.assign(9, 255);
           mesh.indices = {6, 7, 8};
           s.mutable_surface()->set_indices(codec::encode_mesh(mesh)->indices());
         });
       }},
      {"AStyleOutOfRange", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) {
           *s.mutable_points() = cloud(3, 1);
           s.mutable_points()->set_styles(std::string("\xFF\xFF", 2));
         });
       }},
      {"PointsBehindAGap", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) { *s.mutable_points() = cloud(500, 1); });
       }},
      {"ATopologyWithOtherCounts", refused, topology_with_other_counts},
      {"ATopologyWithOtherTriangles", ignored, topology_with_other_triangles},
      {"EpochsInACircle", refused, epochs_in_a_circle},
      {"AnEarlierSequence", refused,
       [](HostileConnection& c) {
         v1::Envelope envelope = a_delta();
         envelope.mutable_delta()->set_sequence(0);
         return c.send(envelope);
       }},
      {"AKindThatThereIsNot", refused,
       [](HostileConnection& c) {
         return spoiled(c, [](v1::EntityState& s) { s.set_kind(std::string(a_million, 'k')); });
       }},
      // ---- too much of what is allowed ----
      {"EndlessSnapshots", ignored, endless_snapshots},
      {"PresenceOfEverybody", ignored, presence_of_everybody},
      {"FailuresOfMegabytes", ignored, failures_of_megabytes},
      {"MessagesForOthers", ignored,
       [](HostileConnection& c) {
         v1::Envelope ack, question, tracking, join;
         ack.mutable_ack()->set_request(99);
         question.mutable_ask()->set_request(1);
         tracking.mutable_tracking()->set_capture_time_ns(std::numeric_limits<std::int64_t>::min());
         join.mutable_join();
         return c.send(ack) && c.send(question) && c.send(tracking) && c.send(join);
       }},
      {"TimesBeyondTheEnd", ignored,
       [](HostileConnection& c) {
         v1::Envelope late = a_delta(), early = a_delta();
         late.mutable_delta()->set_capture_time_ns(std::numeric_limits<std::int64_t>::max());
         early.mutable_delta()->set_capture_time_ns(std::numeric_limits<std::int64_t>::min());
         return c.send(late) && c.send(early);
       }},
      {"AGoodbyeOfMegabytes", hangs_up,
       [](HostileConnection& c) {
         v1::Envelope envelope;
         envelope.mutable_failure()->set_code("internal");
         envelope.mutable_failure()->set_message(std::string(8U << 20U, '\x1B'));
         envelope.mutable_failure()->set_closing(true);
         return c.send(envelope);
       }},
  };
  return all;
}

const std::vector<BadGreeting>& bad_greetings() {
  static const std::vector<BadGreeting> all{
      {"AnotherVersion",
       [](HostileConnection& c) {
         v1::Envelope envelope;
         envelope.mutable_welcome()->set_protocol_major(2);
         (void)c.send(envelope);
       }},
      {"ARefusalOfMegabytes",
       [](HostileConnection& c) {
         v1::Envelope envelope;
         envelope.mutable_failure()->set_code("unsupported");
         envelope.mutable_failure()->set_message(std::string(a_million, '\x1B'));
         envelope.mutable_failure()->set_closing(true);
         (void)c.send(envelope);
       }},
      {"TimesThatOverflow",
       [](HostileConnection& c) {
         v1::Envelope envelope;
         envelope.mutable_welcome()->set_protocol_major(1);
         envelope.mutable_welcome()->set_received_ns(std::numeric_limits<std::int64_t>::min());
         envelope.mutable_welcome()->set_sent_ns(std::numeric_limits<std::int64_t>::max());
         (void)c.send(envelope);
       }},
      {"AScene", [](HostileConnection& c) { (void)send_good_scene(c); }},
      {"Noise", [](HostileConnection& c) { (void)c.send_bytes(noise(4096)); }},
      {"HalfAFrame", [](HostileConnection& c) { (void)c.send_bytes(std::string("\x40\0\0\0\x12", 5)); }},
      {"Silence", [](HostileConnection&) {}},
  };
  return all;
}

}  // namespace handloft::client::test
