#!/usr/bin/env bash
# Fails when an image does not fit its budget: size-budget.sh IMAGE FLASH_BYTES RAM_BYTES
#
# Flash is every section that lies there (.vector_table, .text, .rodata) and the initial values of
# .data. RAM is .data, .bss and .uninit; the stack takes the rest. .defmt and the debug sections stay
# in the ELF and count for nothing.
set -euo pipefail

image=$1 flash_budget=$2 ram_budget=$3

LC_ALL=C size -A -d "$image" | awk -v image="$image" -v flash_budget="$flash_budget" -v ram_budget="$ram_budget" '
    function in_range(address, from, to) { return address >= from && address < to }
    $1 ~ /^\./ && $2 > 0 {
        # STM32F429ZI: flash at 0x08000000 to 0x08200000, RAM at 0x20000000 to 0x20030000.
        flash = in_range($3, 134217728, 136314880) || $1 == ".data" ? $2 : 0
        ram = in_range($3, 536870912, 537067520) ? $2 : 0
        if (flash + ram > 0) printf "%-16s %7d flash %7d RAM\n", $1, flash, ram
        flash_sum += flash
        ram_sum += ram
    }
    END {
        printf "%-16s %7d flash %7d RAM\n", "sum", flash_sum, ram_sum
        printf "%-16s %7d flash %7d RAM\n", "budget", flash_budget, ram_budget
        if (flash_sum == 0 || ram_sum == 0) { print image ": no sections found"; exit 1 }
        if (flash_sum > flash_budget) { print image ": flash over budget by " flash_sum - flash_budget " bytes"; failed = 1 }
        if (ram_sum > ram_budget) { print image ": RAM over budget by " ram_sum - ram_budget " bytes"; failed = 1 }
        exit failed
    }'
