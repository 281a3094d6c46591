// Reads optical waveguides: an infrared emitter (Vishay VSMY1850, 850 nm) and a phototransistor (VEMT7100X01) each.
//
// Circuit, per waveguide: the emitter hangs on a constant-current sink (an op-amp holds LED_MA through a sense
// resistor; its input is LED_PIN, so that supply and temperature do not change the light); the phototransistor
// pulls a load resistor to ground, whose voltage goes to SENSOR_PINS[k]. Choose the resistor so that the straight
// waveguide gives about three quarters of the reference.
//
// Each frame reads every sensor twice, with the emitters off (dark: room light and leakage) and on. Both numbers
// are sent; the host subtracts. Nothing waits for the serial line: a frame that does not fit into its buffer is
// left out, and the gap in the running number says so.

#include "frames.h"

const uint8_t LED_PIN = 5;
const uint8_t SENSOR_PINS[] = {A0, A1};
const char INFO_TEXT[] =
    "{\"channels\":[\"light1\",\"dark1\",\"light2\",\"dark2\"],\"unit\":\"V\","
    "\"unit_per_count\":0.00322265625,\"firmware\":\"mu_sensor 1\"}";  // 3.3 V over 1024 counts
const uint32_t PERIOD_US = 2500;     // 400 frames a second, 9 kB: fits 115200 baud
const uint32_t SETTLE_US = 60;       // the phototransistor's rise, several times over
const uint32_t INFO_PERIOD_US = 1000000;
const uint8_t SENSORS = sizeof(SENSOR_PINS);

uint32_t number = 0;
uint32_t next_us = 0;
uint32_t info_us = 0;
uint16_t dark[SENSORS], light[SENSORS];

void read_all(uint16_t *into) {
  for (uint8_t k = 0; k < SENSORS; k++) into[k] = analogRead(SENSOR_PINS[k]);
}

void send(frames::Frame &frame) {
  uint8_t line[frames::LONGEST + 2];
  const size_t length = frame.finish(line);
  if (length && (size_t)Serial.availableForWrite() >= length) Serial.write(line, length);
}

void send_info() {
  frames::Frame frame(frames::INFO);
  frame.put(INFO_TEXT);
  send(frame);
}

void setup() {
  pinMode(LED_PIN, OUTPUT);
  digitalWrite(LED_PIN, LOW);
  Serial.begin(115200);
  next_us = micros();
  info_us = next_us - INFO_PERIOD_US;
}

void loop() {
  const uint32_t now = micros();
  if ((int32_t)(now - next_us) < 0) return;
  next_us += PERIOD_US;
  if ((int32_t)(now - next_us) > (int32_t)PERIOD_US) next_us = now;  // after a stall, do not hurry to catch up

  read_all(dark);
  digitalWrite(LED_PIN, HIGH);
  delayMicroseconds(SETTLE_US);
  read_all(light);
  digitalWrite(LED_PIN, LOW);

  if (now - info_us >= INFO_PERIOD_US) {
    info_us = now;
    send_info();
  }
  frames::Frame frame(frames::SAMPLE);
  frame.put32(number++);
  frame.put32(now);
  frame.put8(2 * SENSORS);
  for (uint8_t k = 0; k < SENSORS; k++) {
    frame.put16(light[k]);
    frame.put16(dark[k]);
  }
  send(frame);
}
