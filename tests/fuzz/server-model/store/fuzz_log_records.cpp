// Records whose checksums are right and whose contents are any bytes, as a program with a fault, or a forger,
// would leave them (F1): recovery refuses in words, naming the operation, or gives a model; never a crash.
// The input is a sequence of records, each a two-byte little-endian length and a handloft.v1.Operation; every
// third is the answer to the one before.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/store/log_check.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "tests/support/fault_disk.h"

namespace {

namespace store = handloft::store;

void require(bool good) {
  if (!good) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> chunks;
  while (size >= 2) {
    const std::size_t length = std::min<std::size_t>(data[0] + std::size_t{256} * data[1], size - 2);
    chunks.emplace_back(reinterpret_cast<const char*>(data + 2), length);
    data += 2 + length;
    size -= 2 + length;
  }
  std::vector<store::LogRecord> records;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (i % 3 == 2) {
      records.back().answer = chunks[i];
      continue;
    }
    store::LogRecord record;
    record.epoch = 1;
    record.sequence = records.size() + 1;
    record.client_id = i % 2;
    record.operation = chunks[i];
    records.push_back(std::move(record));
  }
  const handloft::test::FaultDisk disk;
  store::LogOptions options;
  options.vfs = disk.name();
  options.mark = store::LogOptions::Mark::none;
  auto log = store::OperationLog::create("model.handloft", store::LogIdentity{{1}, 2}, options);
  require(log.ok());
  if (!records.empty()) require(log->append(records).ok());
  // The records are what was written; what they say is another matter.
  require(store::check_log(*log).good());
  const auto recovered = store::recover(*log);
  if (recovered) {
    require(recovered->model.sequence() == records.size());
    require(!handloft::model::document_hash(recovered->model.document()).empty());
  } else {
    require(!recovered.error().message.empty());
  }
  return 0;
}
