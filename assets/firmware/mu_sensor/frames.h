// Frames of the sensor's serial line: payload, CRC-16, byte stuffing (COBS), a zero byte at the end.
// The other end is mu_addon/sensing/framing.py, which says what the payloads hold.

#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

namespace frames {

const uint8_t SAMPLE = 1;
const uint8_t INFO = 2;
const size_t LONGEST = 250;  // of payload and CRC: one block of COBS

// CRC-16/IBM-3740: polynomial 0x1021, start 0xFFFF, not reflected.
inline uint16_t crc16(const uint8_t *data, size_t length) {
  uint16_t crc = 0xFFFF;
  while (length--) {
    crc ^= (uint16_t)(*data++) << 8;
    for (uint8_t bit = 0; bit < 8; bit++) crc = crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1;
  }
  return crc;
}

// Byte-stuffs length <= 250 bytes into out (length + 2 bytes, the zero at the end included); returns their number.
inline size_t stuff(const uint8_t *data, size_t length, uint8_t *out) {
  size_t code = 0, end = 1;
  for (size_t k = 0; k < length; k++) {
    if (data[k]) {
      out[end++] = data[k];
    } else {
      out[code] = end - code;
      code = end++;
    }
  }
  out[code] = end - code;
  out[end++] = 0;
  return end;
}

// A frame under construction; bytes beyond its end are dropped, and `finish` then returns 0.
class Frame {
 public:
  explicit Frame(uint8_t kind) { put8(kind); }

  void put8(uint8_t value) {
    if (length_ < LONGEST - 2)
      data_[length_++] = value;
    else
      full_ = true;
  }
  void put16(uint16_t value) {
    put8(value & 0xFF);
    put8(value >> 8);
  }
  void put32(uint32_t value) {
    put16(value & 0xFFFF);
    put16(value >> 16);
  }
  void put(const char *text) {
    while (*text) put8(*text++);
  }

  // The bytes to send, in out (LONGEST + 2); returns their number.
  size_t finish(uint8_t *out) {
    if (full_) return 0;
    const uint16_t crc = crc16(data_, length_);
    data_[length_] = crc & 0xFF;
    data_[length_ + 1] = crc >> 8;
    return stuff(data_, length_ + 2, out);
  }

 private:
  uint8_t data_[LONGEST];
  size_t length_ = 0;
  bool full_ = false;
};

}  // namespace frames
