#pragma once
// What was promised to clients, to be held against what is there in the end.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace handloft::simulation {

class Judge {
 public:
  /// Of an operation by its client_op_id, which no two clients of a simulation share.
  enum class Promise {
    sent,
    durable,    ///< Acknowledged with its place in the order.
    unchanged,  ///< Accepted; there was nothing to change.
    applied,    ///< Acknowledged as that only, as was asked: a crash may lose it.
    refused,    ///< The model is as it was.
    unsaved,    ///< Done, but could not be saved: a restart may have lost it.
  };
  struct Told {
    Promise promise = Promise::sent;
    std::uint64_t sequence = 0;
    int times_sent = 0;
  };

  void sent(std::uint64_t op) { ++told_[op].times_sent; }
  void acknowledged(std::uint64_t op, std::uint64_t sequence) {
    Told& told = told_[op];
    const Told now{sequence == 0 ? Promise::unchanged : Promise::durable, sequence, told.times_sent};
    if (told.promise != Promise::sent && (told.promise != now.promise || told.sequence != now.sequence))
      complain("operation " + std::to_string(op) + " was answered twice, and not alike");
    told = now;
  }
  void applied(std::uint64_t op) { told_[op].promise = Promise::applied; }
  void refused(std::uint64_t op) { told_[op].promise = Promise::refused; }
  void unsaved(std::uint64_t op) { told_[op].promise = Promise::unsaved; }

  void complain(std::string words) {
    if (complaints_.size() < most_complaints) complaints_.push_back(std::move(words));
  }

  const std::map<std::uint64_t, Told>& told() const { return told_; }
  const std::vector<std::string>& complaints() const { return complaints_; }

 private:
  static constexpr std::size_t most_complaints = 20;
  std::map<std::uint64_t, Told> told_;
  std::vector<std::string> complaints_;
};

}  // namespace handloft::simulation
