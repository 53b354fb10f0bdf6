// Functions that fill columns row by row. Internal to the builders. The protocol allows a column to be absent if every
// row has the default value. Therefore a column stays empty until a row differs from the default; then the default is
// filled in for all earlier rows.
#ifndef LOCUS_CLIENT_LIB_COLUMNS_H_
#define LOCUS_CLIENT_LIB_COLUMNS_H_

#include "absl/types/span.h"
#include "client/lib/values.h"
#include "google/protobuf/repeated_field.h"

namespace locus::client {

// Appends `value` to a column of a block that had `rows_before` rows before. An empty column stays empty as long as
// every appended value is `default_value`.
template <class T>
void append_row(google::protobuf::RepeatedField<T>& column, int rows_before, T value, T default_value) {
  if (column.empty()) {
    if (value == default_value) return;
    column.Resize(rows_before, default_value);
  }
  column.Add(value);
}

inline void append_rotation(google::protobuf::RepeatedField<float>& column, const Rotation& rotation) {
  for (const float part : {rotation.x, rotation.y, rotation.z, rotation.w}) column.Add(part);
}

inline void append_rotation_row(google::protobuf::RepeatedField<float>& column, int rows_before,
                                const Rotation& rotation) {
  if (column.empty()) {
    if (rotation == Rotation{}) return;
    for (int row = 0; row < rows_before; ++row) append_rotation(column, Rotation{});
  }
  append_rotation(column, rotation);
}

inline void append_triple(google::protobuf::RepeatedField<float>& column, const Float3& value) {
  for (const float part : {value.x, value.y, value.z}) column.Add(part);
}

inline void append_triple(google::protobuf::RepeatedField<double>& column, const Double3& value) {
  for (const double part : {value.x, value.y, value.z}) column.Add(part);
}

template <class T>
void assign(google::protobuf::RepeatedField<T>& column, absl::Span<const T> values) {
  column.Clear();
  column.Add(values.begin(), values.end());
}

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_COLUMNS_H_
