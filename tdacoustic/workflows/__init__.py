"""The commands of tdacoustic as functions, one file each."""
