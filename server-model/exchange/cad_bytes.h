#pragma once
// A model of Open CASCADE as bytes and back. Not for others than cad_* and tests of damaged bytes.

#include <TopoDS_Shape.hxx>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/exchange/cad_labels.h"

namespace handloft::exchange::detail {

struct StoredModel {
  TopoDS_Shape shape;
  std::vector<PartLabel> labels;
};

/// The labels, then the library's binary form without triangles, behind a header with version, length and
/// CRC-32C. Throws the library's exceptions. Errors: resource_exhausted beyond `max_bytes`.
Result<std::string> to_bytes(const StoredModel& model, std::size_t max_bytes);

/// The library trusts what it reads, counts and indices alike, so the checksum keeps damaged bytes from it.
/// It keeps no forger out: these bytes come from our own log, and the session takes none from clients
/// (resolve_operation.h). Logs from before there were labels are read too. Throws the library's exceptions.
/// Errors: data_corrupt.
Result<StoredModel> from_bytes(std::string_view bytes);

}  // namespace handloft::exchange::detail
