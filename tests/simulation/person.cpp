#include "tests/simulation/person.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/base/result.h"

namespace handloft::simulation {
namespace {

constexpr std::uint64_t op_shift = 32;  ///< Of the person's number in its operations' numbers.
constexpr double reconnect_after_s = 0.5;
constexpr double watch_every_s = 1.0;

std::string new_key(std::uint64_t person, std::uint64_t count) {
  std::string key(32, '\0');
  for (std::size_t i = 0; i < 8; ++i) {
    key[i] = static_cast<char>(person >> (8 * i));
    key[8 + i] = static_cast<char>(count >> (8 * i));
  }
  return key;
}

}  // namespace

Person::Person(Timeline& timeline, PersonOptions options, Connect connect, Judge& judge)
    : timeline_(timeline),
      options_(std::move(options)),
      connect_(std::move(connect)),
      judge_(judge),
      key_(new_key(options_.number, 0)) {}

std::size_t Person::number_of(std::uint64_t client_op_id) {
  return static_cast<std::size_t>((client_op_id >> op_shift) - 1);
}

void Person::begin() {
  connect_soon();
  work_later();
  watch();
}

void Person::connect_soon() {
  if (std::exchange(connecting_, true)) return;
  timeline_.after(timeline_.random().unit() * reconnect_after_s, [this] {
    connecting_ = false;
    connect();
  });
}

void Person::connect() {
  if (link_) return;
  if (options_.key == PersonOptions::Key::forgotten) key_ = new_key(options_.number, ++keys_);
  v1::Hello hello;
  hello.set_role(options_.role);
  hello.set_name("person " + std::to_string(options_.number));
  hello.set_client_key(key_);
  const std::uint64_t life = ++life_;
  ClientEnd end;
  end.on_message = [this, life](const v1::Envelope& envelope) {
    if (life == life_) read(envelope);
  };
  end.on_lost = [this, life] {
    if (life == life_) lost();
  };
  heard_ = connected_at_ = timeline_.now();
  link_ = connect_(hello, std::move(end));
  if (!link_) connect_soon();
}

void Person::lost() {
  ++life_;
  link_ = nullptr;
  joined_ = false;
  leases_.clear();
  for (Unanswered& one : unanswered_) one.request = 0;
  connect_soon();
}

void Person::lose_connection() {
  if (!link_) return;
  // The server may believe in it for long after the client has come again.
  link_->client_leaves(timeline_.random().between(0, 20));
  lost();
}

void Person::crash() {
  lose_connection();
  unanswered_.clear();
  mirror_ = std::make_unique<client::SceneMirror>();
  surface_ids_.clear();
}

void Person::stall(double seconds) {
  if (!link_) return;
  link_->client_stalls();
  timeline_.after(seconds, [link = link_] { link->client_reads(); });
}

void Person::wave(int times) {
  if (!connected()) return;
  for (int i = 0; i < times; ++i) {
    v1::Envelope envelope;
    v1::Presence& presence = *envelope.mutable_presence();
    presence.mutable_head()->mutable_world_from_head()->mutable_position()->set_x(timeline_.random().unit());
    if (!link_->client_send(envelope)) return;
  }
}

void Person::join() {
  v1::Envelope envelope;
  v1::Join& request = *envelope.mutable_join();
  request.set_model(options_.model);
  const auto scene = mirror_->scene();
  request.set_epoch(scene->epoch);
  for (const auto& [id, entity] : scene->entities) {
    v1::HeldEntity& have = *request.add_have();
    have.set_id(id);
    have.set_revision(entity->revision);
    have.set_points(entity->points ? static_cast<std::uint32_t>(entity->points->points.size()) : 0);
    const auto surface = surface_ids_.find(id);
    if (entity->surface && surface != surface_ids_.end()) have.set_surface_id(surface->second);
  }
  (void)link_->client_send(envelope);
  ++statistics_.joins;
}

void Person::check(const Status& applied, const char* what) {
  if (!applied) judge_.complain(words() + " cannot read a " + what + ": " + applied.error().describe());
}

void Person::read(const v1::Envelope& envelope) {
  heard_ = timeline_.now();
  trace_ = (trace_ ^ envelope.ByteSizeLong()) * 0x100000001b3U + static_cast<std::uint64_t>(to_ns(heard_));
  const auto keep_surfaces = [this](const auto& states) {
    for (const v1::EntityState& state : states) {
      if (state.has_surface()) surface_ids_[state.id()] = state.surface_id();
      if (!state.surface_shown()) surface_ids_.erase(state.id());
    }
  };
  switch (envelope.body_case()) {
    case v1::Envelope::kWelcome:
      client_id_ = envelope.welcome().client_id();
      join();
      break;
    case v1::Envelope::kSnapshot: {
      if (joined_) {
        ++statistics_.begun_anew;
        if (options_.anew == PersonOptions::Anew::passed_over) break;
      }
      surface_ids_.clear();
      check(mirror_->apply(envelope.snapshot()), "snapshot");
      keep_surfaces(envelope.snapshot().entities());
      if (!joined_) sees();
      break;
    }
    case v1::Envelope::kDelta: {
      const std::uint64_t before = mirror_->scene()->sequence;
      check(mirror_->apply(envelope.delta()), "delta");
      if (envelope.delta().sequence() < before) judge_.complain(words() + " saw the order go back");
      keep_surfaces(envelope.delta().changed());
      if (!joined_) {
        ++statistics_.resumed;
        sees();
      }
      break;
    }
    case v1::Envelope::kAck:
      read_ack(envelope.ack());
      break;
    case v1::Envelope::kFailure:
      if (envelope.failure().closing()) ++statistics_.sent_away;
      if (envelope.failure().closing() && envelope.failure().code() == "permission_denied")
        ++statistics_.denied;
      if (envelope.failure().closing() && envelope.failure().code() == "invalid_argument") {
        judge_.complain(words() + " is sent away: " + envelope.failure().message());
      }
      break;
    default:
      break;
  }
}

void Person::sees() {
  joined_ = true;
  statistics_.longest_join_s =
      std::max(statistics_.longest_join_s, to_seconds(timeline_.now() - connected_at_));
  send_waiting();
}

void Person::read_ack(const v1::Ack& ack) {
  for (auto one = unanswered_.begin(); one != unanswered_.end(); ++one) {
    if (one->request != ack.request()) continue;
    const bool in_memory = one->answer_when == v1::SAVE_LEVEL_APPLIED;
    const std::uint64_t op = one->operation.client_op_id();
    if (!ack.has_failure() && in_memory) {
      if (ack.level() > v1::SAVE_LEVEL_DURABLE) judge_.complain(words() + " is told of no known level");
      judge_.applied(op);
    } else if (!ack.has_failure()) {
      if (ack.sequence() != 0 && ack.level() == v1::SAVE_LEVEL_APPLIED)
        judge_.complain(words() + " is answered before the disk has it");
      judge_.acknowledged(op, ack.sequence());
    } else if (ack.failure().message().find("could not be saved") != std::string::npos) {
      judge_.unsaved(op);
    } else {
      judge_.refused(op);
    }
    unanswered_.erase(one);
    return;
  }
  if (leases_.erase(ack.request()) == 0) judge_.complain(words() + " is answered what it did not ask");
}

void Person::send_waiting() {
  if (!connected()) return;
  for (Unanswered& one : unanswered_) {
    if (one.request != 0) continue;
    v1::Envelope envelope;
    envelope.mutable_submit()->set_request(++last_request_);
    *envelope.mutable_submit()->mutable_operation() = one.operation;
    envelope.mutable_submit()->set_answer_when(one.answer_when);
    if (!link_->client_send(envelope)) return;  // watch() tries again.
    if (one.since != TimePoint{}) ++statistics_.sent_again;
    one.request = last_request_;
    one.since = timeline_.now();
    judge_.sent(one.operation.client_op_id());
  }
}

void Person::work() {
  if (!working_ || !connected() || options_.role == v1::ROLE_VIEWER ||
      unanswered_.size() >= options_.most_unanswered) {
    return;
  }
  if (timeline_.random().chance(options_.leases)) ask_for_lease();
  v1::Operation operation = random_operation(*mirror_->scene(), timeline_.random(), options_.mix);
  operation.set_client_op_id(((options_.number + 1) << op_shift) + ++last_op_);
  const bool hurries = timeline_.random().chance(options_.hurries);
  unanswered_.push_back(
      {std::move(operation), hurries ? v1::SAVE_LEVEL_APPLIED : v1::SAVE_LEVEL_UNSPECIFIED, 0, TimePoint{}});
  ++statistics_.operations;
  send_waiting();
}

void Person::ask_for_lease() {
  const auto& entities = mirror_->scene()->entities;
  if (entities.empty()) return;
  auto one = entities.begin();
  std::advance(one, static_cast<std::ptrdiff_t>(timeline_.random().below(entities.size())));
  v1::Envelope envelope;
  envelope.mutable_lease()->set_request(++last_request_);
  envelope.mutable_lease()->set_entity(one->first);
  envelope.mutable_lease()->set_release(timeline_.random().chance(0.3));
  if (link_->client_send(envelope)) leases_.insert(last_request_);
}

void Person::work_later() {
  timeline_.after(timeline_.random().between(0, 2 * options_.mean_pause_s), [this] {
    work();
    work_later();
  });
}

void Person::watch() {
  timeline_.after(watch_every_s, [this] {
    send_waiting();
    const bool owed = link_ && (!joined_ || !unanswered_.empty());
    const TimePoint waits_since = unanswered_.empty() || !joined_ ? heard_ : unanswered_.front().since;
    if (owed && timeline_.now() - waits_since > from_seconds(options_.patience_s)) {
      ++statistics_.gave_up;
      lose_connection();
    }
    watch();
  });
}

std::string Person::words() const {
  return "person " + std::to_string(options_.number) + " at " + std::to_string(timeline_.seconds()) + " s (" +
         (link_ ? joined_ ? "joined" : "connected" : "away") + ", " + std::to_string(unanswered_.size()) +
         " unanswered, sequence " + std::to_string(mirror_->scene()->sequence) + ")";
}

}  // namespace handloft::simulation
