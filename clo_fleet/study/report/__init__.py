"""What a batch shows: strategies compared on the same seeds (`comparing`), figures (`figures`), one page (`page`)."""
