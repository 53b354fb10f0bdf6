#include "server/convert/result_columns.h"

namespace locus::server {
namespace {

// Appends `entries` entries to the column and returns a pointer to the first. The caller must write all of them.
template <class T>
T* grow(google::protobuf::RepeatedField<T>& column, size_t entries) {
  const int before = column.size();
  column.Reserve(before + static_cast<int>(entries));
  column.AddNAlreadyReserved(static_cast<int>(entries));
  return column.mutable_data() + before;
}

// Accessors of the fields of v1::BlockResult that hold the arrays of kColumnArrays, in the same order.
constexpr auto kFields = std::make_tuple([](v1::BlockResult& to) { return to.mutable_t(); },          //
                                         [](v1::BlockResult& to) { return to.mutable_ids(); },        //
                                         [](v1::BlockResult& to) { return to.mutable_triangles(); },  //
                                         [](v1::BlockResult& to) { return to.mutable_uvs(); },        //
                                         [](v1::BlockResult& to) { return to.mutable_normals(); },    //
                                         [](v1::BlockResult& to) { return to.mutable_points(); },     //
                                         [](v1::BlockResult& to) { return to.mutable_groups(); },     //
                                         [](v1::BlockResult& to) { return to.mutable_tags(); },       //
                                         [](v1::BlockResult& to) { return to.mutable_layers(); },     //
                                         [](v1::BlockResult& to) { return to.mutable_positions(); },  //
                                         [](v1::BlockResult& to) { return to.mutable_rotations(); },  //
                                         [](v1::BlockResult& to) { return to.mutable_others(); });
static_assert(std::tuple_size_v<decltype(kFields)> == std::tuple_size_v<decltype(kColumnArrays)>);

// Calls visit(array, field) for each array of a result and the protocol's field for it.
template <class Visit, size_t... kIndices>
void for_each_field(const Visit& visit, std::index_sequence<kIndices...>) {
  (visit(std::get<kIndices>(kColumnArrays), std::get<kIndices>(kFields)), ...);
}
template <class Visit>
void for_each_field(const Visit& visit) {
  for_each_field(visit, std::make_index_sequence<std::tuple_size_v<decltype(kFields)>>());
}

}  // namespace

ResultColumns::ResultColumns(v1::QueryResult& result, size_t blocks) : result_(result) {
  // Protobuf keeps the memory of cleared blocks, and add_blocks() reuses it.
  result.clear_blocks();
  for (size_t i = 0; i < blocks; ++i) result.add_blocks();
}

RowSpans ResultColumns::add_rows(size_t number, ColumnSet columns, size_t rows) {
  v1::BlockResult& to = block(number);
  RowSpans spans;
  for_each_field([&](const auto& array, const auto& field) {
    if (columns.has(array.column)) array.get(spans) = grow(*field(to), array.width * rows);
  });
  return spans;
}

char* ResultColumns::add_hits(size_t number, size_t queries) {
  std::string& hits = *block(number).mutable_hits();
  hits.resize(hits.size() + queries);
  return hits.data() + (hits.size() - queries);
}

char* ResultColumns::add_matrix(size_t number, size_t bytes) {
  std::string& matrix = *block(number).mutable_sight();
  matrix.resize(matrix.size() + bytes);
  return matrix.data() + (matrix.size() - bytes);
}

uint32_t* ResultColumns::add_counts(size_t number, size_t queries) {
  return grow(*block(number).mutable_counts(), queries);
}

uint32_t* ResultColumns::add_truncated(size_t number, size_t queries) {
  return grow(*block(number).mutable_truncated(), queries);
}

TimeSpans ResultColumns::add_times(size_t number, size_t queries) {
  v1::BlockResult& to = block(number);
  return {grow(*to.mutable_resolved_ticks(), queries), grow(*to.mutable_resolved_fractions(), queries)};
}

uint32_t* ResultColumns::add_clamped(size_t number, size_t queries) {
  return grow(*block(number).mutable_clamped(), queries);
}

uint32_t* ResultColumns::add_unanchored(size_t number, size_t queries) {
  return grow(*block(number).mutable_unanchored(), queries);
}

}  // namespace locus::server
