// What peers ask for, each as far as it may, and the scenes that they are sent.

#include <fmt/core.h>

#include <utility>

#include "server-model/session/peer.h"
#include "server-model/session/peers.h"
#include "server-model/session/presence.h"
#include "server-model/session/remote_target.h"

namespace handloft::session {
namespace {

/// After one that is larger, more is likely to follow.
constexpr std::size_t large_message_bytes = 64U << 10;

/// Counts a request that is under way until finish_request(); at the limit nothing more is read of the peer.
/// To be called before the request is handed over: so it ends, and finish_request() looks, after the pause,
/// whatever other requests do meanwhile, and no peer stays paused with nothing under way.
void begin_request(Peer& peer, std::size_t bytes) {
  bool full = false;
  {
    const std::lock_guard lock(peer.mutex);
    ++peer.pending_requests;
    peer.pending_bytes += bytes;
    full = peer.pending_requests >= peer.max_pending_requests || peer.pending_bytes >= peer.max_pending_bytes;
  }
  if (full) peer.connection->pause_reading();
}

void finish_request(Peer& peer, std::size_t bytes) {
  bool room = false;
  {
    const std::lock_guard lock(peer.mutex);
    --peer.pending_requests;
    peer.pending_bytes -= bytes;
    // Half, so that a peer that keeps the limit filled isn't paused and resumed with every request.
    room = !peer.entering && peer.pending_requests <= peer.max_pending_requests / 2 &&
           peer.pending_bytes <= peer.max_pending_bytes / 2;
  }
  if (room) peer.connection->resume_reading();
}

void send_ack(Peer& peer, std::uint64_t request, const Result<ModelActor::Outcome>& outcome) {
  v1::Envelope envelope;
  v1::Ack& ack = *envelope.mutable_ack();
  ack.set_request(request);
  if (outcome) {
    ack.set_sequence(outcome->sequence);
    ack.mutable_entities()->Assign(outcome->entities.begin(), outcome->entities.end());
    ack.mutable_notes()->Assign(outcome->notes.begin(), outcome->notes.end());
    if (outcome->sequence != 0) {
      ack.set_level(outcome->durable ? v1::SAVE_LEVEL_DURABLE : v1::SAVE_LEVEL_APPLIED);
    }
  } else {
    set_failure(*ack.mutable_failure(), outcome.error());
  }
  peer.connection->send(envelope);  // false: the peer is gone
}

}  // namespace

Status Peers::on_message(const net::ConnectionPtr& connection, const v1::Envelope& envelope) {
  const PeerPtr peer = peer_of(connection);
  if (!peer) return make_error(ErrorCode::cancelled, "a message of nobody who is here");
  // Which models there are is asked of none of them.
  if (!options_.nameless && !envelope.has_join() && !envelope.ask().query().has_models()) {
    const std::lock_guard lock(peer->mutex);
    if (!peer->counted && !peer->entering) return options_.nameless;
  }
  switch (envelope.body_case()) {
    case v1::Envelope::kJoin:
      return join(peer, envelope.join());
    case v1::Envelope::kSubmit:
      submit(peer, envelope.submit());
      return {};
    case v1::Envelope::kAsk:
      ask(peer, envelope.ask());
      return {};
    case v1::Envelope::kPresence:
      presence(peer, envelope.presence());
      return {};
    case v1::Envelope::kTracking:
      tracking(peer, envelope.tracking());
      return {};
    case v1::Envelope::kHandCommand:
      hand_command(peer, envelope.hand_command());
      return {};
    case v1::Envelope::kLease:
      lease(peer, envelope.lease());
      return {};
    default: {
      const auto* kind = v1::Envelope::descriptor()->FindFieldByNumber(envelope.body_case());
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found the message \"{}\", expected join, submit, ask, presence, tracking, "
                      "hand_command or lease",
                      kind == nullptr ? "" : kind->name()),
          "body");
    }
  }
}

std::optional<v1::Envelope> Peers::compose(Peer& peer, const RoomPtr& room) {
  for (;;) {
    std::shared_ptr<const v1::Join> beginning;
    bool whole = false;
    {
      const std::lock_guard lock(peer.mutex);
      if (!peer.seated || peer.room != room) return std::nullopt;
      peer.news = false;  // Before we look at the scene: what comes later is news.
      beginning.swap(peer.beginning);
    }
    const stream::ScenePtr scene = room->actor->scene();
    const stream::Personal own = room->actor->personal(*scene, peer.id);
    if (beginning) peer.viewer.resume(*beginning, *scene);
    {
      const std::lock_guard lock(peer.mutex);
      whole = peer.has.lock() == scene;
    }
    if (!whole || !peer.viewer.has_been_told(own.storage)) {
      if (auto envelope = peer.viewer.next(*scene, own)) return envelope;
    }
    const std::lock_guard lock(peer.mutex);
    if (peer.news || peer.beginning) continue;
    peer.has = scene;
    peer.behind = false;
    return std::nullopt;
  }
}

std::optional<net::Frame> Peers::pull(Peer& peer) {
  const RoomPtr room = room_of(peer);
  const std::lock_guard viewer_lock(peer.viewer_mutex);
  while (const auto envelope = compose(peer, room)) {
    auto frame = net::encode_frame(*envelope, options_.net.max_frame_bytes);
    if (!frame) {
      peer.log.with("model", room->name)
          .error("a scene message cannot be sent: {}", frame.error().describe());
      continue;  // With the rest.
    }
    const std::int64_t captured_ns = envelope->delta().capture_time_ns();
    if (captured_ns > peer.shown_capture_ns) {
      peer.shown_capture_ns = captured_ns;
      const std::lock_guard latency_lock(latency_mutex_);
      const Duration age = clock_.now() - from_ns(captured_ns);
      capture_to_delta_.add(age);
      if (options_.actor.metrics) options_.actor.metrics->shown(age);
    }
    if ((*frame)->size() >= large_message_bytes) {
      const std::lock_guard lock(peer.mutex);
      peer.behind = true;
    }
    return *std::move(frame);
  }
  return std::nullopt;
}

void Peers::submit(const PeerPtr& peer, const v1::Submit& message) {
  const std::uint64_t request = message.request();
  const RoomPtr room = room_of(*peer);
  const v1::Role role = role_of(*peer, *room);
  Status may;
  // The operation first, so that a refusal names the role that it needs, not the one that any needs.
  // Whose a comment is only the model's thread knows for sure.
  // An operation without a body is its to refuse as well.
  if (message.operation().body_case() != v1::Operation::BODY_NOT_SET)
    may = gate_->check(peer->user, room->name, role, message.operation(), access::Ownership::own);
  if (may) may = gate_->check(peer->user, room->name, role, v1::Envelope::kSubmit);
  v1::Operation operation = message.operation();
  operation.set_client_id(peer->id);
  const std::size_t bytes = message.ByteSizeLong();
  const auto answer = [counter = refusals_of(*room), peer, bytes, request](const auto& outcome) {
    if (!outcome) counter.add(Asked::operation, outcome.error());
    send_ack(*peer, request, outcome);
    finish_request(*peer, bytes);
  };
  begin_request(*peer, bytes);
  if (!may) {
    if (operation.client_op_id() == 0) {
      answer(Result<ModelActor::Outcome>(may.error()));
    } else {
      room->actor->answer_again(std::move(operation), may.error(), answer, message.answer_when());
    }
    return;
  }
  note_coming(*peer, *room, role);
  operation.set_author(peer->user.name);
  operation.set_made_ns(options_.wall_ns());
  ModelActor::Allowed allowed;
  if (access::comment_of(operation)) {
    allowed = [gate = gate_, peer, role, model = room->name,
               asked = message.operation()](const model::Document& document) -> Status {
      const auto author_of = [&document](const std::string& id) -> std::optional<std::string> {
        const auto found = document.comments->find(id);
        return found == document.comments->end() ? std::nullopt : std::optional(found->second->author);
      };
      return gate->check(peer->user, model, role, asked,
                         access::ownership_of(asked, peer->user.name, author_of));
    };
  }
  model::FileAccess files = options_.files;
  // TCP knows no users: whoever connects gets the folders, not the machine.
  if (!gate_->owns_host(peer->user)) files.scope = model::FileAccess::Scope::within_folders;
  room->actor->submit(std::move(operation), std::move(files), answer, std::move(allowed),
                      message.answer_when());
}

std::optional<v1::QueryResult> Peers::answer_of_peers(const Peer& peer, const Room& room,
                                                      const v1::Query& query) const {
  v1::QueryResult result;
  if (query.has_people()) {
    result.mutable_people()->mutable_people()->Swap(people_in(room).mutable_people());
    return result;
  }
  if (!query.has_models()) return std::nullopt;
  result.mutable_models();
  for (Rooms::Listed& listed : rooms_->list()) {
    const v1::Role role =
        access::lesser(peer.connection->peer().role, gate_->role_of(peer.user, listed.name));
    if (role == v1::ROLE_UNSPECIFIED) continue;
    v1::ModelsResult::Model& model = *result.mutable_models()->add_models();
    model.set_name(std::move(listed.name));
    model.set_role(std::string(access::role_name(role)));
    model.set_people(static_cast<std::uint32_t>(listed.people));
    model.set_open(listed.open);
    model.set_problem(std::move(listed.problem));
  }
  return result;
}

void Peers::ask(const PeerPtr& peer, const v1::Ask& message) {
  const std::uint64_t request = message.request();
  const RoomPtr room = room_of(*peer);
  const auto answer = [counter = refusals_of(*room), peer, request,
                       limit = options_.net.max_frame_bytes](Result<v1::QueryResult> result) {
    if (!result) counter.add(Asked::query, result.error());
    v1::Envelope envelope;
    envelope.mutable_answer()->set_request(request);
    if (result) {
      *envelope.mutable_answer()->mutable_result() = *std::move(result);
      const auto frame = net::encode_frame(envelope, limit);
      if (frame) {
        peer->connection->send(*frame);
        return;
      }
      envelope.mutable_answer()->clear_result();
      counter.add(Asked::query, frame.error());
      set_failure(*envelope.mutable_answer()->mutable_failure(), frame.error());
    } else {
      set_failure(*envelope.mutable_answer()->mutable_failure(), result.error());
    }
    peer->connection->send(envelope);
  };
  // Which models there are, each is told of those where they have a role: it is about none of them.
  if (!message.query().has_models()) {
    const v1::Role role = role_of(*peer, *room);
    Status may = gate_->check(peer->user, room->name, role, v1::Envelope::kAsk);
    // A query without a body is the model's to refuse, as it always was.
    if (may && message.query().body_case() != v1::Query::BODY_NOT_SET)
      may = gate_->check(peer->user, room->name, role, message.query());
    if (!may) {
      answer(may.error());
      return;
    }
    note_coming(*peer, *room, role);
  }
  if (auto known = answer_of_peers(*peer, *room, message.query())) {
    answer(*std::move(known));
    return;
  }
  const std::size_t bytes = message.ByteSizeLong();
  begin_request(*peer, bytes);
  room->actor->ask(
      message.query(),
      [peer, bytes, answer](Result<v1::QueryResult> result) {
        answer(std::move(result));
        finish_request(*peer, bytes);
      },
      peer->id);
}

void Peers::presence(const PeerPtr& peer, v1::Presence message) {
  const RoomPtr room = room_of(*peer);
  if (!gate_->check(peer->user, room->name, role_of(*peer, *room), v1::Envelope::kPresence)) return;
  message.set_client_id(peer->id);
  message.set_name(peer->connection->peer().name);
  message.set_gone(false);
  {
    const std::lock_guard lock(peer->mutex);
    if (peer->brings_hands) return;  // The server tells more of them, and two stories would alternate.
    peer->present = true;
  }
  send_presence(*room, clean_presence(std::move(message)), peer.get());
}

Result<RoomPtr> Peers::begin_hands(Peer& peer, v1::Envelope::BodyCase message) {
  const RoomPtr room = room_of(peer);
  if (Status may = gate_->check(peer.user, room->name, role_of(peer, *room), message); !may)
    return may.error();
  const std::lock_guard lock(peer.mutex);
  if (!peer.joined) {
    return make_error(ErrorCode::failed_precondition, "found a hand before its client has joined");
  }
  peer.brings_hands = true;
  return room;
}

void Peers::complain(Peer& peer, const Error& error) const {
  refusals_of(*room_of(peer)).add(Asked::hand, error);
  const auto kept_back = peer.complaints.allow(clock_.now());
  if (!kept_back) return;
  peer.log.debug("a frame of \"{}\" ({}) is left out: {}", peer.hands.name, peer.id, error.describe());
  v1::Envelope envelope;
  set_failure(*envelope.mutable_failure(), error);
  peer.connection->send(envelope);
}

void Peers::tracking(const PeerPtr& peer, const v1::TrackingFrame& frame) {
  const auto room = begin_hands(*peer, v1::Envelope::kTracking);
  if (!room) {
    complain(*peer, room.error());
    return;
  }
  auto read = read_client_frame(frame, peer->clock, clock_.now(), options_.client_frames);
  if (!read) {
    complain(*peer, read.error());
    return;
  }
  if ((*room)->actor->push_hand(peer->hands, *std::move(read)) == HandInbox::Taken::left_out) {
    complain(*peer, make_error(ErrorCode::resource_exhausted,
                               fmt::format("more than {} frames a second, some are left out",
                                           options_.actor.client_frames.max_frames_per_s),
                               "tracking"));
  }
}

void Peers::hand_command(const PeerPtr& peer, const v1::HandCommand& message) {
  const std::uint64_t request = message.request();
  const auto room = begin_hands(*peer, v1::Envelope::kHandCommand);
  if (!room) {
    refusals_of(*room_of(*peer)).add(Asked::command, room.error());
    send_ack(*peer, request, room.error());
    return;
  }
  const std::size_t bytes = message.ByteSizeLong();
  begin_request(*peer, bytes);
  (*room)->actor->command(peer->hands, message,
                          [counter = refusals_of(**room), peer, bytes, request](const auto& outcome) {
                            if (!outcome) counter.add(Asked::command, outcome.error());
                            send_ack(*peer, request, outcome);
                            finish_request(*peer, bytes);
                          });
}

void Peers::lease(const PeerPtr& peer, const v1::Lease& message) {
  const std::uint64_t request = message.request();
  const RoomPtr room = room_of(*peer);
  Status may = gate_->check(peer->user, room->name, role_of(*peer, *room), v1::Envelope::kLease);
  if (may) {
    const std::lock_guard lock(peer->mutex);
    // Else nothing would end it: a lease ends with who is there.
    if (!peer->joined)
      may = make_error(ErrorCode::failed_precondition, "found a lease before its client has joined");
  }
  if (!may) {
    refusals_of(*room).add(Asked::lease, may.error());
    send_ack(*peer, request, may.error());
    return;
  }
  const std::size_t bytes = message.ByteSizeLong();
  begin_request(*peer, bytes);
  room->actor->lease(peer->id, message.entity(),
                     message.release() ? ModelActor::LeaseWish::release : ModelActor::LeaseWish::take,
                     [counter = refusals_of(*room), peer, bytes, request](const Status& status) {
                       if (!status) counter.add(Asked::lease, status.error());
                       send_ack(*peer, request,
                                status ? Result<ModelActor::Outcome>(ModelActor::Outcome()) : status.error());
                       finish_request(*peer, bytes);
                     });
}

}  // namespace handloft::session
