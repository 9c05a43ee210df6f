#pragma once
// A client of the simulation, with the real mirror: works, loses its connection, comes again as the same one,
// sends again what was not answered, and gives up a connection on which nothing comes any more.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "client-hmd/mirror/scene_mirror.h"
#include "proto/session.pb.h"
#include "tests/simulation/judge.h"
#include "tests/simulation/link.h"
#include "tests/simulation/random_operation.h"

namespace handloft::simulation {

struct PersonOptions {
  std::uint64_t number = 0;  ///< From 0.
  v1::Role role = v1::ROLE_EDITOR;
  double mean_pause_s = 0.2;        ///< Between two operations.
  std::size_t most_unanswered = 8;  ///< Operations under way.
  double patience_s = 15;           ///< With a connection that owes an answer and says nothing.
  double leases = 0.05;             ///< Of all that it does: to say what it will work on,
  double hurries = 0.1;             ///< or to be answered before the disk has it.
  OperationMix mix;
  std::string model = {};  ///< Empty: the server's first.
  enum class Anew {
    shown,
    passed_over,  ///< Negative control: with a snapshot on a connection that had one it does nothing.
  };
  Anew anew = Anew::shown;
  enum class Key {
    kept,
    forgotten,  ///< Negative control: comes again as somebody else, so that retries cannot be told.
  };
  Key key = Key::kept;
};

struct PersonStatistics {
  std::uint64_t operations = 0;
  std::uint64_t sent_again = 0;
  std::uint64_t joins = 0;
  std::uint64_t resumed = 0;
  std::uint64_t gave_up = 0;
  std::uint64_t begun_anew = 0;  ///< Snapshots on a connection that had one: it had read too slowly.
  std::uint64_t sent_away = 0;   ///< With a Failure,
  std::uint64_t denied = 0;      ///< of these since they may not be here.
  double longest_join_s = 0;
};

class Person {
 public:
  /// Null: nobody is there.
  using Connect = std::function<LinkPtr(const v1::Hello&, ClientEnd)>;

  Person(Timeline& timeline, PersonOptions options, Connect connect, Judge& judge);
  Person(const Person&) = delete;
  Person& operator=(const Person&) = delete;

  void begin();
  void works(bool yes) { working_ = yes; }
  /// Waves so many times at once.
  void wave(int times);
  void stall(double seconds);
  /// The program dies and is started again: what it had sent is nobody's any more.
  void crash();
  void lose_connection();

  bool connected() const { return link_ != nullptr && joined_; }
  /// Connected, to what it believes, and nothing that it sent is unanswered.
  bool content() const { return connected() && link_->whole() && unanswered_.empty(); }
  std::string words() const;  ///< For a complaint.
  const client::SceneMirror& mirror() const { return *mirror_; }
  const LinkPtr& link() const { return link_; }
  const PersonOptions& options() const { return options_; }
  /// Whose operation it is.
  static std::size_t number_of(std::uint64_t client_op_id);
  std::uint64_t client_id() const { return client_id_; }
  const PersonStatistics& statistics() const { return statistics_; }
  std::uint64_t trace() const { return trace_; }  ///< Of all that it was told.

 private:
  struct Unanswered {
    v1::Operation operation;
    v1::SaveLevel answer_when = v1::SAVE_LEVEL_UNSPECIFIED;
    std::uint64_t request = 0;  ///< 0: not sent on this connection.
    TimePoint since;
  };
  void connect_soon();
  void connect();
  void lost();
  void read(const v1::Envelope& envelope);
  void sees();
  void read_ack(const v1::Ack& ack);
  void check(const Status& applied, const char* what);
  void join();
  void work();
  void ask_for_lease();
  void work_later();
  void send_waiting();
  void watch();

  Timeline& timeline_;
  const PersonOptions options_;
  const Connect connect_;
  Judge& judge_;
  std::string key_;
  std::uint64_t keys_ = 0;
  std::unique_ptr<client::SceneMirror> mirror_ = std::make_unique<client::SceneMirror>();
  std::map<std::string, std::uint64_t> surface_ids_;
  LinkPtr link_;
  std::uint64_t life_ = 0;  ///< Of the connection: what came of an earlier one is late.
  std::uint64_t client_id_ = 0;
  bool joined_ = false;
  bool connecting_ = false;
  bool working_ = true;
  TimePoint heard_;
  TimePoint connected_at_;
  std::set<std::uint64_t> leases_;  ///< Requests, of this connection.
  std::deque<Unanswered> unanswered_;
  std::uint64_t last_op_ = 0;
  std::uint64_t last_request_ = 0;
  PersonStatistics statistics_;
  std::uint64_t trace_ = 0;
};

}  // namespace handloft::simulation
