// As much of an Arduino board as the sketch touches: time passes a little with every call, sensors follow a script.
#pragma once
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

const uint8_t A0 = 14, A1 = 15, OUTPUT = 1, LOW = 0, HIGH = 1;

struct Board {
  uint32_t now_us = 4294000000u;  // a second before the clock wraps
  bool led = false;
  uint32_t reads = 0;
  int room = 1000000;  // free bytes of the serial buffer
};
extern Board board;

inline uint32_t micros() { return board.now_us += 7; }
inline void delayMicroseconds(uint32_t us) { board.now_us += us; }
inline void pinMode(uint8_t, uint8_t) {}
inline void digitalWrite(uint8_t, uint8_t value) { board.led = value; }
// Light: 700 + pin; dark: 20 + pin, so that a mix-up shows.
inline int analogRead(uint8_t pin) {
  board.now_us += 100;
  board.reads++;
  return (board.led ? 700 : 20) + pin;
}

struct Port {
  void begin(long) {}
  int availableForWrite() { return board.room; }
  size_t write(const uint8_t *data, size_t length) { return fwrite(data, 1, length, stdout); }
};
extern Port Serial;
