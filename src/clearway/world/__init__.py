"""What is true: moves robots and obstacles, senses, notices contact; simulate() runs one trial."""
