#include "tests/support/fault_disk.h"

#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <new>
#include <random>
#include <set>

namespace handloft::test {

namespace {

constexpr std::size_t block_bytes = 512;
constexpr int path_limit = 512;

void write_at(std::string& file, std::size_t offset, std::string_view data) {
  if (file.size() < offset + data.size()) file.resize(offset + data.size());
  std::copy(data.begin(), data.end(), file.begin() + static_cast<std::ptrdiff_t>(offset));
}

void perform(FaultDisk::Files& files, const FaultDisk::Event& event) {
  switch (event.kind) {
    case FaultDisk::Event::Kind::write:
      write_at(files[event.file], event.offset, event.data);
      break;
    case FaultDisk::Event::Kind::truncate:
      files[event.file].resize(event.offset);
      break;
    case FaultDisk::Event::Kind::remove:
      files.erase(event.file);
      break;
    case FaultDisk::Event::Kind::flush:
      break;
  }
}

}  // namespace

struct FaultDisk::State {
  sqlite3_vfs vfs{};
  std::string name;
  Files files;
  struct Shared {
    std::vector<std::unique_ptr<char[]>> regions;
    std::set<const void*> users;
  };
  std::map<std::string, Shared> shared;
  std::vector<Event> events;
  std::size_t reads = 0;
  std::size_t calls = 0;
  std::size_t fail_index = 0;
  Failure failure = Failure::none;

  /// Whether this call, neither of a read nor of a write, shall fail.
  bool call_fails() {
    const bool fails = failure == Failure::call_error && calls == fail_index;
    if (fails) failure = Failure::none;
    ++calls;
    return fails;
  }

  /// Whether the next write or flush shall fail.
  Failure next() {
    if (failure == Failure::none || failure == Failure::read_error || failure == Failure::call_error)
      return Failure::none;
    const bool for_good = failure == Failure::full_for_good || failure == Failure::error_for_good;
    if (events.size() < fail_index || (!for_good && events.size() > fail_index)) return Failure::none;
    const Failure now = failure;
    if (!for_good) failure = Failure::none;
    return now;
  }
};

namespace {

using State = FaultDisk::State;
using Event = FaultDisk::Event;
using Failure = FaultDisk::Failure;

struct File {
  sqlite3_file base;
  State* disk;
  std::string* path;
  bool remove_on_close;
};

File& of(sqlite3_file* file) {
  return *reinterpret_cast<File*>(file);
}

int close_file(sqlite3_file* file) {
  File& one = of(file);
  if (one.remove_on_close) one.disk->files.erase(*one.path);
  delete one.path;
  return SQLITE_OK;
}

int read_file(sqlite3_file* file, void* to, int amount, sqlite3_int64 offset) {
  File& one = of(file);
  if (one.disk->failure == Failure::read_error && one.disk->reads == one.disk->fail_index) {
    one.disk->failure = Failure::none;
    ++one.disk->reads;
    return SQLITE_IOERR_READ;
  }
  ++one.disk->reads;
  const std::string& content = one.disk->files[*one.path];
  const auto from = static_cast<std::size_t>(offset);
  const auto wanted = static_cast<std::size_t>(amount);
  const std::size_t got = from >= content.size() ? 0 : std::min(wanted, content.size() - from);
  std::memcpy(to, content.data() + std::min(from, content.size()), got);
  if (got == wanted) return SQLITE_OK;
  std::memset(static_cast<char*>(to) + got, 0, wanted - got);
  return SQLITE_IOERR_SHORT_READ;
}

int write_file(sqlite3_file* file, const void* data, int amount, sqlite3_int64 offset) {
  File& one = of(file);
  const Failure failure = one.disk->next();
  std::string_view bytes(static_cast<const char*>(data), static_cast<std::size_t>(amount));
  if (failure == Failure::torn_error) bytes = bytes.substr(0, bytes.size() / 2);
  if (failure == Failure::none || failure == Failure::torn_error) {
    one.disk->events.push_back(
        {Event::Kind::write, *one.path, static_cast<std::size_t>(offset), std::string(bytes)});
    perform(one.disk->files, one.disk->events.back());
  }
  if (failure == Failure::none) return SQLITE_OK;
  return failure == Failure::full_for_good ? SQLITE_FULL : SQLITE_IOERR_WRITE;
}

int truncate_file(sqlite3_file* file, sqlite3_int64 size) {
  File& one = of(file);
  if (const Failure failure = one.disk->next(); failure != Failure::none)
    return failure == Failure::full_for_good ? SQLITE_FULL : SQLITE_IOERR_TRUNCATE;
  one.disk->events.push_back({Event::Kind::truncate, *one.path, static_cast<std::size_t>(size), {}});
  perform(one.disk->files, one.disk->events.back());
  return SQLITE_OK;
}

int flush_file(sqlite3_file* file, int) {
  File& one = of(file);
  // A full disk may still flush what it has.
  const Failure failure = one.disk->next();
  if (failure != Failure::none && failure != Failure::full_for_good) return SQLITE_IOERR_FSYNC;
  one.disk->events.push_back({Event::Kind::flush, *one.path, 0, {}});
  return SQLITE_OK;
}

int file_size(sqlite3_file* file, sqlite3_int64* size) {
  if (of(file).disk->call_fails()) return SQLITE_IOERR_FSTAT;
  *size = static_cast<sqlite3_int64>(of(file).disk->files[*of(file).path].size());
  return SQLITE_OK;
}

int lock_file(sqlite3_file* file, int) {
  return of(file).disk->call_fails() ? SQLITE_IOERR_LOCK : SQLITE_OK;
}
int unlock_file(sqlite3_file*, int) {
  return SQLITE_OK;
}
int check_lock(sqlite3_file*, int* locked) {
  *locked = 0;
  return SQLITE_OK;
}
int control(sqlite3_file*, int, void*) {
  return SQLITE_NOTFOUND;
}
int sector_size(sqlite3_file*) {
  return static_cast<int>(block_bytes);
}
int characteristics(sqlite3_file*) {
  return 0;
}

int map_shared(sqlite3_file* file, int page, int bytes, int extend, void volatile** to) {
  *to = nullptr;
  if (of(file).disk->call_fails()) return SQLITE_IOERR_SHMMAP;
  State::Shared& shared = of(file).disk->shared[*of(file).path];
  shared.users.insert(file);
  auto& regions = shared.regions;
  while (regions.size() <= static_cast<std::size_t>(page)) {
    if (extend == 0) return SQLITE_OK;
    regions.push_back(std::make_unique<char[]>(static_cast<std::size_t>(bytes)));
  }
  *to = regions[static_cast<std::size_t>(page)].get();
  return SQLITE_OK;
}
int lock_shared(sqlite3_file* file, int, int, int flags) {
  return (flags & SQLITE_SHM_LOCK) != 0 && of(file).disk->call_fails() ? SQLITE_IOERR_SHMLOCK : SQLITE_OK;
}
void barrier(sqlite3_file*) {}
int unmap_shared(sqlite3_file* file, int) {
  // When the last connection is gone the next one finds none, as after a restart.
  State::Shared& shared = of(file).disk->shared[*of(file).path];
  shared.users.erase(file);
  if (shared.users.empty()) of(file).disk->shared.erase(*of(file).path);
  return SQLITE_OK;
}

const sqlite3_io_methods methods = {2,          close_file,   read_file,       write_file,  truncate_file,
                                    flush_file, file_size,    lock_file,       unlock_file, check_lock,
                                    control,    sector_size,  characteristics, map_shared,  lock_shared,
                                    barrier,    unmap_shared, nullptr,         nullptr};

State& disk_of(sqlite3_vfs* vfs) {
  return *static_cast<State*>(vfs->pAppData);
}

int open_file(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* flags_out) {
  static std::atomic<int> anonymous{0};
  State& disk = disk_of(vfs);
  File& one = of(file);
  one.base.pMethods = nullptr;
  if (disk.call_fails()) return SQLITE_CANTOPEN;
  const std::string path = name != nullptr ? name : "temporary-" + std::to_string(++anonymous);
  if (!disk.files.contains(path)) {
    if ((flags & SQLITE_OPEN_CREATE) == 0) return SQLITE_CANTOPEN;
    disk.files.emplace(path, std::string());
  }
  one.disk = &disk;
  one.path = new std::string(path);
  one.remove_on_close = (flags & SQLITE_OPEN_DELETEONCLOSE) != 0;
  one.base.pMethods = &methods;
  if (flags_out != nullptr) *flags_out = flags;
  return SQLITE_OK;
}

int remove_file(sqlite3_vfs* vfs, const char* name, int) {
  State& disk = disk_of(vfs);
  // What is full can be made emptier.
  if (const Failure failure = disk.next(); failure != Failure::none && failure != Failure::full_for_good)
    return SQLITE_IOERR_DELETE;
  if (!disk.files.contains(name)) return SQLITE_IOERR_DELETE_NOENT;
  // With the folder flushed: SQLite asks for it where it matters.
  disk.events.push_back({Event::Kind::remove, name, 0, {}});
  perform(disk.files, disk.events.back());
  return SQLITE_OK;
}

int access_file(sqlite3_vfs* vfs, const char* name, int flags, int* result) {
  if (disk_of(vfs).call_fails()) return SQLITE_IOERR_ACCESS;
  const auto& files = disk_of(vfs).files;
  const auto found = files.find(name);
  *result = found != files.end() && (flags != SQLITE_ACCESS_EXISTS || !found->second.empty()) ? 1 : 0;
  return SQLITE_OK;
}

int full_path(sqlite3_vfs*, const char* name, int bytes, char* to) {
  sqlite3_snprintf(bytes, to, "%s", name);
  return SQLITE_OK;
}

int randomness(sqlite3_vfs*, int bytes, char* to) {
  // The same salts in every run, so that every run has the same events.
  std::memset(to, 7, static_cast<std::size_t>(bytes));
  return bytes;
}
int sleep_a_while(sqlite3_vfs*, int microseconds) {
  return microseconds;
}
int current_time(sqlite3_vfs*, double* days) {
  *days = 2461000.5;
  return SQLITE_OK;
}
int last_error(sqlite3_vfs*, int, char*) {
  return 0;
}

}  // namespace

FaultDisk::FaultDisk(Files files) : state_(std::make_unique<State>()) {
  static std::atomic<int> count{0};
  state_->files = std::move(files);
  state_->name = "fault-disk-" + std::to_string(++count);
  sqlite3_vfs& vfs = state_->vfs;
  vfs.iVersion = 1;
  vfs.szOsFile = static_cast<int>(sizeof(File));
  vfs.mxPathname = path_limit;
  vfs.zName = state_->name.c_str();
  vfs.pAppData = state_.get();
  vfs.xOpen = open_file;
  vfs.xDelete = remove_file;
  vfs.xAccess = access_file;
  vfs.xFullPathname = full_path;
  vfs.xRandomness = randomness;
  vfs.xSleep = sleep_a_while;
  vfs.xCurrentTime = current_time;
  vfs.xGetLastError = last_error;
  if (sqlite3_vfs_register(&vfs, 0) != SQLITE_OK) throw std::bad_alloc();
}

FaultDisk::~FaultDisk() {
  sqlite3_vfs_unregister(&state_->vfs);
}

const std::string& FaultDisk::name() const {
  return state_->name;
}

void FaultDisk::fail_at(std::size_t index, Failure failure) {
  state_->failure = failure;
  const std::size_t so_far = failure == Failure::read_error   ? state_->reads
                             : failure == Failure::call_error ? state_->calls
                                                              : state_->events.size();
  state_->fail_index = index + so_far;
}

std::size_t FaultDisk::reads() const {
  return state_->reads;
}

std::size_t FaultDisk::calls() const {
  return state_->calls;
}

const std::vector<FaultDisk::Event>& FaultDisk::events() const {
  return state_->events;
}

FaultDisk::Files FaultDisk::files() const {
  return state_->files;
}

FaultDisk::Files after_crash(const FaultDisk::Files& before, const std::vector<FaultDisk::Event>& events,
                             std::size_t end, Crash crash, std::uint64_t seed) {
  FaultDisk::Files files = before;
  if (crash == Crash::process_dies) {
    for (std::size_t i = 0; i < std::min(end, events.size()); ++i) perform(files, events[i]);
    if (end < events.size() && events[end].kind == Event::Kind::write) {
      Event torn = events[end];
      torn.data.resize(torn.data.size() / 2);
      perform(files, torn);
    }
    return files;
  }
  // What was flushed is there; of the rest nothing, or some blocks.
  std::map<std::string, std::vector<const Event*>> waiting;
  for (std::size_t i = 0; i < std::min(end, events.size()); ++i) {
    const Event& event = events[i];
    if (event.kind == Event::Kind::flush || event.kind == Event::Kind::remove) {
      for (const Event* one : waiting[event.file]) perform(files, *one);
      waiting.erase(event.file);
      perform(files, event);
      if (event.kind == Event::Kind::flush) files[event.file];
    } else {
      waiting[event.file].push_back(&event);
    }
  }
  if (crash == Crash::power_fails) return files;
  std::mt19937_64 random(seed);
  for (const auto& [file, lost] : waiting) {
    for (const Event* event : lost) {
      if (event->kind == Event::Kind::truncate) {
        if ((random() & 1U) != 0) perform(files, *event);
        continue;
      }
      for (std::size_t at = 0; at < event->data.size(); at += block_bytes) {
        if ((random() & 1U) == 0) continue;
        const Event block{Event::Kind::write, event->file, event->offset + at,
                          event->data.substr(at, block_bytes)};
        perform(files, block);
      }
    }
  }
  return files;
}

}  // namespace handloft::test
