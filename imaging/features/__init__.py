"""What a picture shows of lines, corners and circles, and how their errors depend on those of edge points."""
