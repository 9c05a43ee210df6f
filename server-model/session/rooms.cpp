#include "server-model/session/rooms.h"

#include <fmt/core.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "server-model/access/names.h"
#include "server-model/session/actor_threads.h"

namespace handloft::session {

namespace fs = std::filesystem;

std::vector<std::string> model_names_in(const fs::path& folder) {
  constexpr std::size_t most_looked_at = 100'000;  // In a folder that is no folder of models.
  std::vector<std::string> names;
  std::error_code failed;
  std::size_t looked_at = 0;
  for (fs::directory_iterator it(folder, failed), end; !failed && it != end && looked_at < most_looked_at;
       it.increment(failed), ++looked_at) {
    if (it->path().extension() != model_suffix) continue;
    std::string name = it->path().stem().string();
    if (check_model_name(name)) names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  return names;
}

Status check_model_name(std::string_view name) {
  return access::check_model_name(name, "join.model");
}

void Room::close() {
  actor->end_gestures();
  actor->settle();
  actor->stop();
  if (store) store->stop();
}

Rooms::Rooms(RoomsOptions options, RoomPtr first, Furnish furnish, const Clock& clock, Logger log)
    : options_(std::move(options)),
      first_(std::move(first)),
      furnish_(std::move(furnish)),
      clock_(clock),
      log_(std::move(log)),
      queue_(options_.queue) {
  entries_[first_->name].room = first_;
  if (!queue_ && !options_.folder.empty()) queue_ = start_queue();
}

Rooms::~Rooms() {
  stop();
}

fs::path Rooms::path_of(const std::string& name) const {
  return options_.folder / (name + std::string(model_suffix));
}

// With mutex_ held.
Status Rooms::may_open(const std::string& name, IfMissing if_missing) const {
  if (Status good = check_model_name(name); !good) return good;
  if (options_.folder.empty()) {
    return make_error(ErrorCode::not_found,
                      fmt::format("found \"{}\", expected \"{}\" or nothing", name, first_->name),
                      "join.model");
  }
  std::error_code failed;
  if (!fs::exists(path_of(name), failed)) {
    if (if_missing == IfMissing::refuse || options_.create == RoomsOptions::Create::nobody) {
      return make_error(ErrorCode::not_found, fmt::format("there is no model \"{}\"", name), "join.model");
    }
    if (const std::size_t count = model_names_in(options_.folder).size(); count >= options_.max_models) {
      return make_error(ErrorCode::resource_exhausted, fmt::format("there are {} models already", count),
                        "join.model");
    }
  }
  const auto open = std::count_if(entries_.begin(), entries_.end(), [](const auto& item) {
    return item.second.room != nullptr || !item.second.waiting.empty();
  });
  if (static_cast<std::size_t>(open) >= options_.max_open) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("{} models are open already, try again when somebody has left", open),
                      "join.model");
  }
  return {};
}

void Rooms::enter(const std::string& asked, IfMissing if_missing, const Entered& entered) {
  const std::string& name = asked.empty() ? first_->name : asked;
  RoomPtr room;
  Status may;
  bool begin = false;
  {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(name);
    if (stopped_) {
      may = make_error(ErrorCode::cancelled, "the server is stopping", "join.model");
    } else if (found != entries_.end() && found->second.room) {
      room = found->second.room;
      ++found->second.people;
    } else if (found != entries_.end() && !found->second.waiting.empty()) {
      found->second.waiting.push_back(entered);
      return;
    } else if (may = may_open(name, if_missing); may) {
      entries_[name].waiting.push_back(entered);
      begin = true;
    }
  }
  if (begin) {
    queue_->post([this, name] { open(name); });
  } else if (room) {
    entered(std::move(room));
  } else {
    entered(may.error());
  }
}

void Rooms::open(const std::string& name) {
  Result<OpenedModel> opened = options_.open ? options_.open(path_of(name))
                                             : Result<OpenedModel>(OpenedModel{model::Model(), nullptr});
  Result<RoomPtr> room = make_error(ErrorCode::internal, "not opened");
  if (opened) {
    room = furnish_(name, *std::move(opened));
    log_.with("model", name).info("model \"{}\" is open", name);
  } else {
    room = make_error(opened.error().code,
                      fmt::format("the model \"{}\" cannot be opened: {}", name, opened.error().message),
                      "join.model");
    log_.with("model", name).error("{}", room.error().message);
  }
  std::vector<Entered> waiting;
  {
    const std::lock_guard lock(mutex_);
    Entry& entry = entries_[name];
    waiting.swap(entry.waiting);
    entry.problem = room ? std::string() : room.error().message;
    if (room) {
      entry.room = *room;
      entry.people = waiting.size();
      entry.empty_since = clock_.now();
    }
  }
  for (const Entered& entered : waiting) entered(room);
}

void Rooms::leave(const RoomPtr& room) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(room->name);
  if (found == entries_.end() || found->second.room != room || found->second.people == 0) return;
  if (--found->second.people == 0) found->second.empty_since = clock_.now();
}

std::vector<RoomPtr> Rooms::open_rooms() const {
  const std::lock_guard lock(mutex_);
  std::vector<RoomPtr> result;
  for (const auto& [name, entry] : entries_) {
    if (entry.room) result.push_back(entry.room);
  }
  return result;
}

std::vector<Rooms::Listed> Rooms::list() const {
  std::map<std::string, Listed> listed;
  if (!options_.folder.empty()) {
    for (std::string& name : model_names_in(options_.folder)) listed[name].name = name;
  }
  const std::lock_guard lock(mutex_);
  for (const auto& [name, entry] : entries_) {
    if (!entry.room && !listed.contains(name)) continue;  // It was asked for, and is not there.
    listed[name] = {name, entry.people, entry.room != nullptr, entry.problem};
    if (!entry.room || !entry.room->store) continue;
    if (const Status kept = entry.room->store->failure(); !kept) listed[name].problem = kept.error().message;
  }
  std::vector<Listed> result;
  result.reserve(listed.size());
  for (auto& [name, each] : listed) result.push_back(std::move(each));
  return result;
}

void Rooms::tick() {
  std::vector<RoomPtr> unused;
  {
    const std::lock_guard lock(mutex_);
    const TimePoint now = clock_.now();
    for (auto it = entries_.begin(); it != entries_.end();) {
      Entry& entry = it->second;
      const bool ends = entry.room && entry.room != first_ && entry.people == 0 &&
                        now - entry.empty_since >= options_.close_after;
      if (ends) unused.push_back(std::exchange(entry.room, nullptr));
      // Names that were asked for once must not fill the memory; what is wrong with a file is found anew.
      const bool idle = !entry.room && entry.waiting.empty() &&
                        (entry.problem.empty() || entries_.size() > options_.max_models);
      it = idle ? entries_.erase(it) : std::next(it);
    }
  }
  // Whoever joins from now on waits until it is closed and opened again: the queue is in order.
  for (RoomPtr& room : unused) {
    log_.with("model", room->name).info("model \"{}\" is closed: nobody was there for a while", room->name);
    queue_->post([room = std::move(room)] { room->close(); });
  }
}

void Rooms::stop() {
  std::vector<RoomPtr> rooms;
  std::vector<Entered> waiting;
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(stopped_, true)) return;
  }
  // What is being closed is closed to its end.
  if (queue_) {
    queue_->run_and_wait([] {});
    queue_->stop();
  }
  {
    const std::lock_guard lock(mutex_);
    for (auto& [name, entry] : entries_) {
      if (entry.room) rooms.push_back(entry.room);
      std::move(entry.waiting.begin(), entry.waiting.end(), std::back_inserter(waiting));
      entry.waiting.clear();
    }
  }
  for (const Entered& entered : waiting) entered(make_error(ErrorCode::cancelled, "the server is stopping"));
  for (const RoomPtr& room : rooms) room->close();
}

}  // namespace handloft::session
