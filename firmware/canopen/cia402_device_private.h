/* SPDX-License-Identifier: MIT */
/* cia402_device_private: what the files of cia402_device share. */
#ifndef CANOPEN_CIA402_DEVICE_PRIVATE_H
#define CANOPEN_CIA402_DEVICE_PRIVATE_H

#include "canopen/cia402_device.h"

/* The option codes 0x605A from which on the drive stays in Quick stop active. */
#define CIA402_QUICK_STOP_STAYS 5

/* Another state: a stop that was under way, or over, belongs to the one before. True when it changed. */
bool cia402_device_enter(struct cia402_device *device, enum cia402_state state);

#endif
