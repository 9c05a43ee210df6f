#pragma once
// Puts large clouds into cells off the frame loop (V5), as curvature_worker.h does with curvatures: one
// thread, newest wins.

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "client-hmd/render/point_cells.h"

namespace handloft::client {

struct SortedPoints {
  std::shared_ptr<const PointSet> set;  ///< Of which they are,
  std::size_t count = 0;                ///< the first so many.
  PointCells cells;
};

class PointSorter {
 public:
  PointSorter();
  ~PointSorter();  ///< Waits for the cloud that is being worked on.
  PointSorter(const PointSorter&) = delete;
  PointSorter& operator=(const PointSorter&) = delete;

  /// Never waits. The same again costs nothing.
  void want(const std::string& id, std::shared_ptr<const PointSet> set, std::size_t count);
  void forget(const std::string& id);
  /// The newest that is ready; null: none yet. It may be of an older cloud than was wanted last.
  std::shared_ptr<const SortedPoints> newest(const std::string& id) const;
  /// Until everything that was wanted is ready: for stills.
  void wait();

 private:
  struct Job {
    std::shared_ptr<const PointSet> wanted;
    std::size_t count = 0;
    std::shared_ptr<const SortedPoints> ready;
    bool due() const {
      return wanted != nullptr && (ready == nullptr || ready->set != wanted || ready->count != count);
    }
  };
  void run();

  mutable std::mutex mutex_;
  std::condition_variable changed_;  ///< Something is wanted, or ready, or it ends.
  std::map<std::string, Job> jobs_;
  std::string last_;  ///< Worked on last: entities take turns.
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace handloft::client
